"""Fits a network of normals: fit_normals.py --pass first FILES > core/regression/first_normal_network.cpp

FILES are those of `fit_choice measure-normals`, of the same pass, first or second. With --from NETWORK, a file that
this wrote, the fit goes on from there, more gently. Needs PyTorch (python3-torch). Shares of the error that is left go to
stderr.
"""

import argparse

import torch
from torch import nn

from network_fit import print_layer, print_matrix, print_network, read_numbers, read_rows, train

FLOOR = 1e-3  # of lengths
LEAST_ERROR = 0.4  # degrees; a pair with less counts as one with this
EPOCHS, BATCH, RATE, DECAY = 12, 8192, 2e-3, 0.05
MORE_EPOCHS, GENTLE_RATE = 4, 5e-4


class Network(nn.Module):
    """See NormalNetwork in core/regression/normal_network.h."""

    def __init__(self, mixtures, hidden, vectors, scalars):
        super().__init__()
        factors = mixtures + vectors.shape[2]
        self.mixing = nn.Linear(vectors.shape[2], mixtures, bias=False)
        self.layers = nn.Sequential(
            nn.Linear(factors + scalars.shape[1], hidden), nn.ReLU(), nn.Linear(hidden, hidden), nn.ReLU(),
            nn.Linear(hidden, factors))
        nn.init.zeros_(self.layers[-1].weight)
        nn.init.zeros_(self.layers[-1].bias)
        self.register_buffer("means", scalars.mean(0))
        self.register_buffer("deviations", scalars.std(0) + 1e-3)

    def forward(self, vectors, scalars):
        """vectors: [face, axis, vector]. Returns the turns, [face, axis]."""
        everything = torch.cat([self.mixing(vectors), vectors], 2)
        lengths = torch.log(FLOOR + torch.sqrt((everything ** 2).sum(1) + 1e-16))
        scalars = (scalars - self.means) / self.deviations
        factors = self.layers(torch.cat([lengths, scalars], 1))
        return (everything * factors[:, None, :]).sum(2)


    def take(self, numbers):
        """What print_weights wrote."""
        layers = [part for i in (0, 2, 4) for part in (self.layers[i].weight, self.layers[i].bias)]
        matrices = [self.mixing.weight] + layers
        assert len(numbers) == sum(matrix.numel() for matrix in matrices), "of another network"
        with torch.no_grad():
            for matrix in matrices:
                matrix.copy_(numbers[:matrix.numel()].reshape(matrix.shape))
                numbers = numbers[matrix.numel():]
            weight, scalars = self.layers[0].weight, len(self.means)
            self.layers[0].bias += weight[:, -scalars:] @ self.means
            weight[:, -scalars:] *= self.deviations


def errors(turns, targets):
    """Angles in degrees between faces that turn and where they should look."""
    cosine = ((turns * targets[:, :2]).sum(1) + targets[:, 2]) / torch.sqrt(1 + (turns ** 2).sum(1))
    sine = torch.sqrt(torch.clamp(1 - cosine * cosine, min=1e-9))
    return torch.rad2deg(torch.atan2(sine, cosine))


def read(files):
    """Sizes of the network; weights, vectors, scalars and targets of faces. Errors count relative to their pair's."""
    (vectors, scalars, *sizes), rows = read_rows(files)
    _, where, counts = torch.unique(rows[:, 0], return_inverse=True, return_counts=True)
    weights = 1 / torch.clamp(torch.rad2deg(rows[:, 1]), min=LEAST_ERROR) / counts[where]
    first, second = 2 + 2 * vectors, 2 + 2 * vectors + scalars
    return (sizes, weights / weights.mean(), rows[:, 2:first].reshape(-1, 2, vectors), rows[:, first:second],
            rows[:, second:])


def fitted(sizes, weights, vectors, scalars, targets, start):
    """`start`: the numbers of a network to go on from, or none."""
    torch.manual_seed(2)
    network = Network(*sizes, vectors, scalars)
    before = (weights * errors(torch.zeros(len(weights), 2), targets)).mean().item()
    if start is not None:
        network.take(start)
    epochs, rate = (EPOCHS, RATE) if start is None else (MORE_EPOCHS, GENTLE_RATE)

    def loss_of(rows):
        return (weights[rows] * errors(network(vectors[rows], scalars[rows]), targets[rows])).mean()

    train(network, len(weights), loss_of, lambda mean: f"{mean / before:.4f} of the error is left", epochs, BATCH, rate,
          DECAY)
    return network


def print_weights(network):
    first, second, third = (network.layers[i] for i in (0, 2, 4))
    weight, bias, scalars = first.weight.clone(), first.bias.clone(), len(network.means)
    weight[:, -scalars:] /= network.deviations
    bias -= weight[:, -scalars:] @ network.means
    print_matrix(network.mixing.weight)
    print_layer(weight, bias)
    print_layer(second.weight, second.bias)
    print_layer(third.weight, third.bias)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="start", metavar="NETWORK", type=read_numbers)
    parser.add_argument("--pass", dest="word", required=True, choices=["first", "second"])
    parser.add_argument("files", nargs="+")
    arguments = parser.parse_args()
    print_network("normal", fitted(*read(arguments.files), arguments.start), print_weights, arguments.word)
