"""What the fits of networks share: fit_labels.py, fit_normals.py. Needs PyTorch (python3-torch)."""

import re
import sys

import numpy
import torch
from torch import nn


def read_rows(files):
    """Sizes of the network, as the program that wrote the files knows them, and rows, which begin with their pair."""
    rows, pairs = [], 0
    for file in files:
        with open(file, "rb") as data:
            *sizes, width = (int(word) for word in data.readline().split())
            part = numpy.fromfile(data, numpy.float32).reshape(-1, width)
        part[:, 0] += pairs
        pairs = int(part[:, 0].max()) + 1
        rows.append(part)
    return sizes, torch.from_numpy(numpy.concatenate(rows))


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


def read_numbers(file):
    """Those of a network in a file that print_network wrote."""
    with open(file, encoding="ascii") as source:
        text = source.read()
    return torch.tensor([float(word) for word in re.findall(r"(?<=[{,])-?[\d.]+(?:e[-+]?\d+)?(?=F?[,}])", text)])


def braced(numbers):
    return "{" + ",".join(f"{number:.6g}F" if "." in f"{number:.6g}" or "e" in f"{number:.6g}" else f"{number:.6g}"
                          for number in numbers) + "}"


def print_matrix(matrix):
    print("{{\n" + ",\n".join("{" + braced(row) + "}" for row in matrix.tolist()) + "}},")


def print_layer(weight, bias):
    print_matrix(weight)
    print("{" + braced(bias.tolist()) + "},")


@torch.no_grad()
def print_network(word, network, print_weights, which=""):
    """The source of core/regression/{word}_network.cpp, or {which}_{word}_network.cpp."""
    kind = f"{word.capitalize()}Network"
    print(f'#include "core/regression/{word}_network.h"\n\nnamespace crease {{\n')
    print(f"// Written by tests/quality/fit_{word}s.py.\n// clang-format off\n")
    print(f"const {kind} k{which.capitalize()}{kind}{{")
    print_weights(network)
    print("};\n\n// clang-format on\n\n}  // namespace crease")
