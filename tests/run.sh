#!/usr/bin/env bash
# Installs what is missing, builds, and runs the tests: tests/run.sh [STEP…]
# Without a step all of them run but tidy, asan, load and bench; each runs even when an earlier one failed, unless the build did.
#   build     the release preset, tests and benchmarks included
#   unit service quality   the rooms of tests under ctest
#   gltf      results of the command line through the Khronos validator
#   lint      formatting and shellcheck
#   fuzz [SECONDS]   what once was a fault, then every fuzzer for so long (10), under both sanitizers of asan
#   tsan      the service tests under ThreadSanitizer
#   tidy      the same and clang-tidy
#   asan      the unit tests under AddressSanitizer and UndefinedBehaviorSanitizer
#   load      streams, jobs a second, overload and a soak on a real server
#   bench     proposals per second, against a textbook loop
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
readonly steps=(build unit service quality gltf lint fuzz tsan)
readonly bin=build/release/bin
cores=$(nproc)

ctest_room() { # ROOM [OPTION…]
  ctest --preset release --label-regex "^$1\$" --no-tests=error "${@:2}"
}

run_build() {
  docker/install-packages.sh build demo test
  cmake --preset release
  cmake --build --preset release
}

run_unit() { ctest_room unit --parallel "$cores"; }
run_service() { ctest_room service; }
run_quality() { ctest_room quality; }

run_gltf() {
  local results=build/gltf mesh name
  rm -rf "$results" && mkdir -p "$results"
  tar --extract --file /usr/share/doc/libcgal-dev/data.tar.gz --directory "$results" \
    --strip-components=2 data/meshes/fandisk.off
  "$bin/crease" noise "$results/fandisk.off" -o "$results/fandisk.obj" --sigma 0.3
  for mesh in "$results/fandisk.obj" tests/gltf/*.obj; do
    name=$(basename "$mesh" .obj)
    "$bin/crease" smooth --local "$mesh" -p sweeps=20 -o "$results/$name.glb" --ridges "$results/$name-ridges.glb"
  done
  npm ci --prefix tests/gltf --no-audit --no-fund
  node tests/gltf/validate.mjs "$results"
}

run_lint() { tests/lint.sh; }
run_tidy() { tests/lint.sh tidy; }

run_asan() {
  cmake --preset asan
  cmake --build --preset asan --target unit_tests
  ctest --preset asan --label-regex '^unit$' --no-tests=error --parallel "$cores"
}

run_tsan() {
  local reports=$PWD/build/tsan/reports
  docker/install-packages.sh build
  cmake --preset tsan
  cmake --build --preset tsan --target service_tests creased crease
  rm -rf "$reports" && mkdir "$reports"
  # The tests start servers, these workers: a race in any of them leaves a file, whatever becomes of the process.
  CREASED_TEST_KILLS=4 TSAN_OPTIONS="log_path=$reports/race suppressions=$PWD/tests/tsan.supp" \
    ctest --preset tsan --label-regex '^service$' --no-tests=error --parallel "$cores"
  if [[ -n $(ls "$reports") ]]; then cat "$reports"/* && exit 1; fi
}

run_fuzz() {
  docker/install-packages.sh build fuzz
  tests/fuzz/run.sh "$@"
}

run_load() { node tests/bench/load.mjs "$bin"; }
run_bench() { "$bin/crease_bench"; }

if { (($# == 1)) || [[ ${2:-} =~ ^[0-9]+$ ]]; } && declare -F "run_$1" >/dev/null; then
  "run_$1" "${@:2}"
  exit
fi

for step in "$@"; do
  declare -F "run_$step" >/dev/null || { echo "$0: no step '$step'" >&2 && exit 2; }
done

# Every step in a process of its own, so that its first fault ends it and nothing else.
failed=()
for step in "${@:-${steps[@]}}"; do
  if [[ $step == tsan ]] && ((SECONDS > ${CREASED_TEST_BUDGET:-SECONDS})); then
    echo "=== tsan LEFT OUT: $SECONDS s are over the budget of $CREASED_TEST_BUDGET s; run it with tests/run.sh tsan"
    continue
  fi
  echo "=== $step"
  started=$SECONDS
  "$0" "$step" || failed+=("$step")
  echo "=== $step took $((SECONDS - started)) s"
  [[ ${failed[*]} != build ]] || break
done
if ((${#failed[@]} > 0)); then
  echo "FAILED: ${failed[*]}"
  exit 1
fi
echo "All steps passed: ${*:-${steps[*]}}"
