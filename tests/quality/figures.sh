#!/usr/bin/env bash
# Reproduces the paper's figures: pictures and numbers in tests/quality/figures/README.md.
# usage: tests/quality/figures.sh [3] [4] [5] [6]     default: all four
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/../.."
if (($# == 0)); then set -- 3 4 5 6; fi

docker/install-packages.sh build demo
[[ -f build/release/build.ninja ]] || cmake --preset release
cmake --build --preset release --target crease_figures
build/release/bin/crease_figures tests/quality/figures "$@"
echo "tests/quality/figures/README.md"
