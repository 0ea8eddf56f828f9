#!/usr/bin/env bash
# Installs what is missing, builds, and runs the tests: tests/run.sh [STEP…]
# Without a step all of them run but postgresql, kubernetes, shared_faults, shared_load, faults, format, load, pictures,
# references and bench; each runs even when an earlier one failed, unless the build did.
#   build     the release preset, tests and benchmarks included
#   unit service quality   the rooms of tests under ctest, one process for each suite
#   postgresql   the tests that concern the store, on a PostgreSQL that they start
#   openapi   the OpenAPI document through two linters, and the answers of the service tests against it
#   gltf      results of the command line through the Khronos validator; originals, conversions and compression through
#             glTF-Transform and three.js, originals of all formats through Assimp
#   kubernetes   what docker/kubernetes renders to, against the schemas of Kubernetes
#   page      the web page in Chromium; pictures in build/page, compared with tests/page/references
#   lint      formatting and shellcheck
#   asan      the unit tests under AddressSanitizer and UndefinedBehaviorSanitizer
#   fuzz [SECONDS [TARGET…]]   what once was a fault, then every fuzzer for so long (5), in the build of asan
#   tsan      the service tests whose threads share something, under ThreadSanitizer
#   tidy [FILE… | all]   clang-tidy over what differs from main, over the files, or over everything. Among other steps it
#             begins no file after CREASED_TIDY_SECONDS (180), and says so
#   shared_faults   PostgreSQL fails over, its disk is full, connections to it are cut, clocks are apart: as root, minutes
#   shared_load [FIGURE…]   what a PostgreSQL carries: claims, changes, events, idle, storage, million [JOBS]; minutes
#   faults [RUNS]   a call on files fails in each of so many runs (1000) of a job through a server
#   format    rewrites every source as lint wants it
#   load      streams, jobs a second, overload and a soak on a real server
#   pictures  takes the pictures of the page in README.md anew: look at them before they are committed
#   references   takes the pictures with which those of the page are compared: look at build/page before
#   bench     proposals per second, against a textbook loop
# CREASED_TEST_BUDGET=SECONDS leaves out tidy and tsan where they would begin after so long, fuzz after twice as long, and
# four suites more under asan, and says so.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
readonly steps=(build unit service openapi quality gltf page lint asan fuzz tsan tidy)
readonly takes_words='^(faults|fuzz|shared_load|tidy)$'
readonly bin=build/release/bin
# What cannot run on this machine ends with this code.
readonly cannot_run=77

ctest_room() { # PRESET ROOM [OPTION…]
  local log=build/$1/Testing/Temporary/LastTest.log
  rm -f "$log"
  ctest --preset "$1" --label-regex "^$2\$" --no-tests=error --parallel "$(nproc)" "${@:3}"
  { grep --no-filename --only-matching 'SKIPPED \] [A-Za-z].*' "$log" || true; } | sort --unique
}

run_build() {
  docker/install-packages.sh build page demo test
  cmake --preset release
  cmake --build --preset release
}

run_unit() { ctest_room release unit; }
run_service() {
  rm -rf build/answers && mkdir -p build/answers
  CREASED_TEST_ANSWERS=$PWD/build/answers ctest_room release service
}
run_postgresql() {
  docker/install-packages.sh test
  export CREASED_TEST_STORE=postgresql
  local of_faults=StoreFaultsTest
  "$bin/unit_tests" --gtest_filter="StoreTest.*:AttemptsTest.*:KeepingTest.*:$of_faults.AJobThat*:$of_faults.*Owner*:$of_faults.Small*"
  "$bin/service_tests" --gtest_filter='Events.*:Jobs.*:Links.*:Results.*:SharedKills.*:SharedStart.*:SharedStore.*:Submit.*'
}
run_quality() { ctest_room release quality; }

run_openapi() {
  docker/install-packages.sh page demo
  npm ci --prefix tests/openapi --no-audit --no-fund
  "$bin/creased" openapi >build/openapi.json
  export REDOCLY_TELEMETRY=off REDOCLY_SUPPRESS_UPDATE_NOTICE=true
  local linters=tests/openapi/node_modules/.bin problems
  problems=$("$linters/redocly" lint --config tests/openapi/redocly.yaml --format json build/openapi.json)
  jq --exit-status '.totals.errors + .totals.warnings == 0' <<<"$problems" || { echo "$problems" && exit 1; }
  "$linters/spectral" lint --ruleset tests/openapi/spectral.yaml --fail-severity hint build/openapi.json
  [[ -d build/answers ]] || run_service
  node tests/openapi/validate.mjs build/openapi.json build/answers
}

run_gltf() {
  local results=build/gltf mesh name
  docker/install-packages.sh page demo test
  rm -rf "$results" && mkdir -p "$results"
  tar --extract --file /usr/share/doc/libcgal-dev/data.tar.gz --directory "$results" \
    --strip-components=2 data/meshes/fandisk.off
  "$bin/crease" noise "$results/fandisk.off" -o "$results/fandisk.obj" --sigma 0.3
  for mesh in "$results/fandisk.obj" tests/gltf/*.obj; do
    name=$(basename "$mesh" .obj)
    "$bin/crease" smooth --local "$mesh" -p sweeps=20 -o "$results/$name.glb" --ridges "$results/$name-ridges.glb"
  done
  npm ci --prefix tests/gltf --no-audit --no-fund
  node tests/gltf/original.mjs make "$results/scene.glb"
  for mesh in "$results/scene.glb" "$results/fandisk.glb"; do
    name=$(basename "$mesh" .glb)-original
    "$bin/crease" smooth --local "$mesh" -p noise_sigma=0.1 -o "$results/$name.glb"
    node tests/gltf/original.mjs compare "$mesh" "$results/$name.glb"
  done
  node tests/gltf/readers.mjs "$bin/crease" "$results"
  node tests/gltf/assimp.mjs "$bin/crease" "$results"
  node tests/gltf/validate.mjs "$results"
}

run_kubernetes() {
  docker/install-packages.sh page test
  npm ci --prefix tests/kubernetes --no-audit --no-fund
  kubectl kustomize docker/kubernetes >build/kubernetes.yaml
  node tests/kubernetes/check.mjs <build/kubernetes.yaml
}

run_page() {
  docker/install-packages.sh page test
  npm ci --prefix tests/page --no-audit --no-fund
  CREASED_BIN=$PWD/$bin CREASED_SHOTS=$PWD/build/page CREASED_CLIENT=$PWD/build/release/client/page \
    node --test --test-concurrency=1 tests/page/page.test.mjs tests/page/uploads.test.mjs tests/page/client.test.mjs
}

run_references() {
  rm -rf tests/page/references
  CREASED_TAKE_REFERENCES=yes run_page
}

run_lint() { tests/lint.sh; }
run_format() { tests/lint.sh format; }

run_tidy() {
  docker/install-packages.sh build test fuzz
  tests/lint.sh tidy "$@"
}

# Suites that run what others run too, on more settings: minutes in this build.
readonly long_under_asan='JobNeeds|ParameterEffect'
# Where there is a budget, also those that only read sources, and two whose code runs in other suites as well.
readonly too_long_for_a_budget='Classical|Contributing/RecipeTest|Rooms|Uncertainty'
run_asan() {
  local left_out=$long_under_asan
  if [[ -n ${CREASED_TEST_BUDGET:-} ]]; then left_out+="|$too_long_for_a_budget"; fi
  docker/install-packages.sh build fuzz
  cmake --preset asan
  cmake --build --preset asan --target unit_tests
  echo "Left out under AddressSanitizer: ${left_out//|/, }"
  ctest_room asan unit --exclude-regex "^($left_out)\$"
}

run_fuzz() {
  docker/install-packages.sh build fuzz
  cmake --preset asan
  cmake --build --preset asan --target creased_fuzz
  tests/fuzz/run.sh "$@"
}

# Its shadow memory is in the way of what kernels with vm.mmap_rnd_bits over 28 may put there. Containers may forbid to
# go without random addresses.
readonly without_random_addresses=(setarch --addr-no-randomize)
# Suites that ask one thing after another, those of the command line, which this build leaves out, and one that starts and
# kills so many programs that it would take too long.
readonly one_thread_at_a_time='^(BasePath|Browsers.*|CommandLine|HostileUploads|Key(s|Configuration|Command)|OpenApi|Links.*|Proxy|Shared(Kills|Start|Store)|Weights)$'
run_tsan() {
  local reports=$PWD/build/tsan/reports launcher=() try failed=no
  docker/install-packages.sh build
  cmake --preset tsan
  if "${without_random_addresses[@]}" true 2>/dev/null; then launcher=("${without_random_addresses[@]}"); fi
  echo 'int main() {}' | c++ -fsanitize=thread -x c++ - -o build/tsan/probe
  for try in {1..30}; do
    "${launcher[@]}" build/tsan/probe && continue
    echo "ThreadSanitizer does not start here (try $try). Either allow programs to switch off random addresses (for" \
      "docker: --security-opt seccomp=unconfined), or set on the host: sysctl vm.mmap_rnd_bits=28"
    exit $cannot_run
  done
  cmake --build --preset tsan --target service_tests
  rm -rf "$reports" && mkdir "$reports"
  # The tests start servers, these workers: a race in any of them leaves a file, whatever becomes of the process.
  CREASED_TEST_KILLS=4 TSAN_OPTIONS="log_path=$reports/race suppressions=$PWD/tests/tsan.supp" \
    "${launcher[@]}" "$0" --ctest-room tsan service --exclude-regex "$one_thread_at_a_time" || failed=yes
  if [[ -n $(ls "$reports") ]]; then cat "$reports"/*; fi
  [[ -z $(ls "$reports") && $failed == no ]]
}

run_pictures() {
  docker/install-packages.sh page test
  npm ci --prefix tests/page --no-audit --no-fund
  CREASED_BIN=$PWD/$bin node tests/page/pictures.mjs client/web/pictures
}

run_shared_faults() {
  docker/install-packages.sh test faults
  CREASED_SHARED_FAULTS=yes "$bin/service_tests" --gtest_filter='SharedFaults.*'
}
run_faults() {
  CREASED_FAILING_RUNS=${1:-1000} "$bin/service_tests" --gtest_filter='FailingDisk.*'
}
run_shared_load() {
  docker/install-packages.sh test
  "$bin/shared_load" "$@"
}
run_load() { node tests/bench/load.mjs "$bin"; }
run_bench() { "$bin/crease_bench"; }

if [[ ${1:-} == --ctest-room ]]; then
  ctest_room "${@:2}"
  exit
fi
if (($# > 0)) && declare -F "run_$1" >/dev/null && { (($# == 1)) || [[ $1 =~ $takes_words ]]; }; then
  "run_$1" "${@:2}"
  exit
fi

for step in "$@"; do
  declare -F "run_$step" >/dev/null || { echo "$0: no step '$step'" >&2 && exit 2; }
done

export CREASED_TIDY_SECONDS=${CREASED_TIDY_SECONDS:-180}

is_over_budget() { # STEP
  local budget=${CREASED_TEST_BUDGET:-$SECONDS}
  case $1 in
    tidy | tsan) ((SECONDS > budget)) ;;
    fuzz) ((SECONDS > 2 * budget)) ;;
    *) false ;;
  esac
}

# Every step in a process of its own, so that its first fault ends it and nothing else.
failed=() left_out=()
for step in "${@:-${steps[@]}}"; do
  if is_over_budget "$step"; then
    echo "=== $step LEFT OUT: $SECONDS s are over the budget of $CREASED_TEST_BUDGET s; run it with $0 $step"
    left_out+=("$step")
    continue
  fi
  echo "=== $step"
  started=$SECONDS code=0
  "$0" "$step" || code=$?
  case $code in
    0) ;;
    "$cannot_run") left_out+=("$step") ;;
    *) failed+=("$step") ;;
  esac
  echo "=== $step took $((SECONDS - started)) s"
  [[ ${failed[*]} != build ]] || break
done
if ((${#left_out[@]} > 0)); then echo "LEFT OUT: ${left_out[*]}"; fi
if ((${#failed[@]} > 0)); then
  echo "FAILED: ${failed[*]}"
  exit 1
fi
echo "All steps passed: ${*:-${steps[*]}}"
