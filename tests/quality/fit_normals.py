"""Fits the network of normals of core/regression: fit_normals.py FILES > core/regression/normal_network.cpp

FILES are those of `fit_choice measure-normals`. Needs PyTorch (python3-torch). Shares of the error that is left go to
stderr, those of models that the fit has not seen first.
"""

import sys

import numpy
import torch
from torch import nn

VECTORS, SCALARS, MIXTURES, HIDDEN = 28, 32, 36, 64  # as in core/regression
FLOOR = 1e-3  # of lengths
LEAST_ERROR = 0.4  # degrees; a pair with less counts as one with this
EPOCHS, BATCH, RATE, DECAY = 12, 8192, 2e-3, 0.05


class Network(nn.Module):
    """See NormalNetwork in core/regression/normal_network.h."""

    def __init__(self, scalars):
        super().__init__()
        self.mixing = nn.Linear(VECTORS, MIXTURES, bias=False)
        self.layers = nn.Sequential(
            nn.Linear(MIXTURES + VECTORS + SCALARS, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU(),
            nn.Linear(HIDDEN, MIXTURES + VECTORS))
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


def errors(turns, targets):
    """Angles in degrees between faces that turn and where they should look."""
    cosine = ((turns * targets[:, :2]).sum(1) + targets[:, 2]) / torch.sqrt(1 + (turns ** 2).sum(1))
    sine = torch.sqrt(torch.clamp(1 - cosine * cosine, min=1e-9))
    return torch.rad2deg(torch.atan2(sine, cosine))


def read(files):
    width = 2 + 2 * VECTORS + SCALARS + 3
    rows, pairs = [], 0
    for file in files:
        part = numpy.fromfile(file, numpy.float32).reshape(-1, width)
        part[:, 0] += pairs
        pairs = int(part[:, 0].max()) + 1
        rows.append(part)
    rows = torch.from_numpy(numpy.concatenate(rows))
    _, where, counts = torch.unique(rows[:, 0], return_inverse=True, return_counts=True)
    weights = 1 / torch.clamp(torch.rad2deg(rows[:, 1]), min=LEAST_ERROR) / counts[where]
    vectors = rows[:, 2:2 + 2 * VECTORS].reshape(-1, 2, VECTORS)
    scalars = rows[:, 2 + 2 * VECTORS:2 + 2 * VECTORS + SCALARS]
    return rows[:, 0], weights / weights.mean(), vectors, scalars, rows[:, -3:]


def train(network, count, loss_of, tell, epochs, batch, rate, decay=0):
    """Minimises the mean of loss_of(rows) over `count` rows; tell(mean) makes of it what is said after each epoch."""
    optimizer = torch.optim.AdamW(network.parameters(), lr=rate, weight_decay=decay)
    batches = count // batch
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=epochs * batches, pct_start=0.1)
    for epoch in range(epochs):
        total = 0
        order = torch.randperm(count)
        for number in range(batches):
            loss = loss_of(order[number * batch:(number + 1) * batch])
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), 1)
            optimizer.step()
            schedule.step()
            total += loss.item() / batches
        print(f"epoch {epoch}: {tell(total)}", file=sys.stderr, flush=True)


def fitted(weights, vectors, scalars, targets):
    torch.manual_seed(2)
    network = Network(scalars)
    before = (weights * errors(torch.zeros(len(weights), 2), targets)).mean().item()

    def loss_of(rows):
        return (weights[rows] * errors(network(vectors[rows], scalars[rows]), targets[rows])).mean()

    train(network, len(weights), loss_of, lambda mean: f"{mean / before:.4f} of the error is left", EPOCHS, BATCH, RATE,
          DECAY)
    return network


def braced(numbers):
    return "{" + ",".join(f"{number:.6g}F" if "." in f"{number:.6g}" or "e" in f"{number:.6g}" else f"{number:.6g}"
                          for number in numbers) + "}"


def print_matrix(matrix):
    print("{{\n" + ",\n".join("{" + braced(row) + "}" for row in matrix.tolist()) + "}},")


def print_layer(weight, bias):
    print_matrix(weight)
    print("{" + braced(bias.tolist()) + "},")


def print_network(network):
    print('#include "core/regression/normal_network.h"\n\nnamespace crease {\n')
    print("// Written by tests/quality/fit_normals.py.\n// clang-format off\n")
    print("const NormalNetwork kNormalNetwork{")
    with torch.no_grad():
        first, second, third = (network.layers[i] for i in (0, 2, 4))
        weight, bias = first.weight.clone(), first.bias.clone()
        weight[:, -SCALARS:] /= network.deviations
        bias -= weight[:, -SCALARS:] @ network.means
        print_matrix(network.mixing.weight)
        print_layer(weight, bias)
        print_layer(second.weight, second.bias)
        print_layer(third.weight, third.bias)
    print("};\n\n// clang-format on\n\n}  // namespace crease")


if __name__ == "__main__":
    _, *samples = read(sys.argv[1:])
    print_network(fitted(*samples))
