"""Fits the network of labels of core/regression: fit_labels.py FILES > core/regression/label_network.cpp

FILES are those of `fit_choice measure-labels`. Needs PyTorch (python3-torch). Cross entropies go to stderr.
"""

import sys

import torch
from torch import nn

from network_fit import print_layer, print_network, read_rows, train

EPOCHS, BATCH, RATE = 30, 4096, 3e-3


class Network(nn.Module):
    """See LabelNetwork in core/regression/label_network.h."""

    def __init__(self, hidden, features):
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(features.shape[1], hidden), nn.ReLU(), nn.Linear(hidden, hidden),
                                    nn.ReLU(), nn.Linear(hidden, 1))
        self.register_buffer("means", features.mean(0))
        self.register_buffer("deviations", features.std(0) + 1e-3)

    def forward(self, features):
        """features: [edge, feature]. Returns the logarithms of the odds that edges are ridges."""
        return self.layers((features - self.means) / self.deviations)[:, 0]


def read(files):
    """Size of the network; weights, features and ridges of edges. Every pair counts the same."""
    (hidden,), rows = read_rows(files)
    _, where = torch.unique(rows[:, 0], return_inverse=True)
    edges = torch.zeros(where.max() + 1).index_add(0, where, rows[:, 1])
    weights = rows[:, 1] / edges[where]
    return hidden, weights / weights.mean(), rows[:, 2:-1], rows[:, -1]


def fitted(hidden, weights, features, ridges):
    torch.manual_seed(1)
    network = Network(hidden, features)

    def loss_of(rows):
        return nn.functional.binary_cross_entropy_with_logits(network(features[rows]), ridges[rows], weights[rows])

    train(network, len(weights), loss_of, lambda mean: f"cross entropy {mean:.5f}", EPOCHS, BATCH, RATE)
    return network


def print_weights(network):
    first, second, third = (network.layers[i] for i in (0, 2, 4))
    weight = first.weight / network.deviations
    print_layer(weight, first.bias - weight @ network.means)
    print_layer(second.weight, second.bias)
    print_layer(third.weight, third.bias)


if __name__ == "__main__":
    print_network("label", fitted(*read(sys.argv[1:])), print_weights)
