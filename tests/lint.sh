#!/usr/bin/env bash
# Formatting and shellcheck over every file of ours; `tests/lint.sh tidy` adds clang-tidy, which takes long.
# Configures the release preset where it is missing.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
readonly rooms=(core proto server client tests)

find "${rooms[@]}" -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' \) -print0 |
  xargs -0 clang-format --dry-run -Werror
echo "clang-format: clean"

find "${rooms[@]}" docker -name node_modules -prune -o -name '*.sh' -print0 | xargs -0 shellcheck .ci/run
echo "shellcheck: clean"

if [[ ${1:-} != tidy ]]; then exit; fi

[[ -f build/release/compile_commands.json ]] || cmake --preset release
cmake --build --preset release --target crease_messages # the headers that protoc makes
# The database is gcc's; clang does not know every warning that it names.
run-clang-tidy -quiet -j "$(nproc)" -p build/release -extra-arg=-Wno-unknown-warning-option \
  "^$PWD/($(IFS='|' && echo "${rooms[*]}"))/"
echo "clang-tidy: clean"
