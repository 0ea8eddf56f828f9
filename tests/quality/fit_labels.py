"""Fits the network of labels of core/regression: fit_labels.py FILES > core/regression/label_network.cpp

FILES are those of `fit_choice measure-labels`. Needs PyTorch (python3-torch). Cross entropies go to stderr.
"""

import sys

import numpy
import torch
from torch import nn

from fit_normals import print_layer, train

FEATURES, HIDDEN = 22, 32  # as in core/regression
EPOCHS, BATCH, RATE = 24, 4096, 3e-3


class Network(nn.Module):
    """See LabelNetwork in core/regression/label_network.h."""

    def __init__(self, features):
        super().__init__()
        self.layers = nn.Sequential(nn.Linear(FEATURES, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU(),
                                    nn.Linear(HIDDEN, 1))
        self.register_buffer("means", features.mean(0))
        self.register_buffer("deviations", features.std(0) + 1e-3)

    def forward(self, features):
        """features: [edge, feature]. Returns the logarithms of the odds that edges are ridges."""
        return self.layers((features - self.means) / self.deviations)[:, 0]


def read(files):
    """Weights, features and ridges. Every pair counts the same."""
    rows, pairs = [], 0
    for file in files:
        part = numpy.fromfile(file, numpy.float32).reshape(-1, FEATURES + 3)
        part[:, 0] += pairs
        pairs = int(part[:, 0].max()) + 1
        rows.append(part)
    rows = torch.from_numpy(numpy.concatenate(rows))
    _, where = torch.unique(rows[:, 0], return_inverse=True)
    edges = torch.zeros(where.max() + 1).index_add(0, where, rows[:, 1])
    weights = rows[:, 1] / edges[where]
    return rows[:, 0], weights / weights.mean(), rows[:, 2:-1], rows[:, -1]


def fitted(weights, features, ridges):
    torch.manual_seed(1)
    network = Network(features)

    def loss_of(rows):
        return nn.functional.binary_cross_entropy_with_logits(network(features[rows]), ridges[rows], weights[rows])

    train(network, len(weights), loss_of, lambda mean: f"cross entropy {mean:.5f}", EPOCHS, BATCH, RATE)
    return network


def print_network(network):
    print('#include "core/regression/label_network.h"\n\nnamespace crease {\n')
    print("// Written by tests/quality/fit_labels.py.\n// clang-format off\n")
    print("const LabelNetwork kLabelNetwork{")
    with torch.no_grad():
        first, second, third = (network.layers[i] for i in (0, 2, 4))
        weight = first.weight / network.deviations
        print_layer(weight, first.bias - weight @ network.means)
        print_layer(second.weight, second.bias)
        print_layer(third.weight, third.bias)
    print("};\n\n// clang-format on\n\n}  // namespace crease")


if __name__ == "__main__":
    _, *samples = read(sys.argv[1:])
    print_network(fitted(*samples))
