#!/usr/bin/env bash
# Replays past failures, then fuzzes: tests/fuzz/run.sh [SECONDS [TARGET…]]. `tests/run.sh fuzz` builds first.
# Runs each named target, or all of them, for SECONDS (5), several at a time. The seed is fixed, so a new failure comes
# from a change of the code; FUZZ_SEED=$RANDOM takes another seed. Interesting inputs stay in build/fuzz/found and
# failing ones in build/fuzz/faults. Move a failing input to tests/fuzz/regressions.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/../.."
readonly fuzzer=build/asan/bin/creased_fuzz
export UBSAN_OPTIONS=print_stacktrace=1
# Short allocation traces and a job store in memory double the number of executions.
export ASAN_OPTIONS=malloc_context_size=3:quarantine_size_mb=16
if [[ -w /dev/shm ]]; then export TMPDIR=/dev/shm; fi

replay_and_fuzz() { # SECONDS TARGET
  local found=build/fuzz/found/$2 faults=build/fuzz/faults/$2 regressions=tests/fuzz/regressions/$2
  local options=(-timeout=10 -rss_limit_mb=2048 "-artifact_prefix=$faults/")
  rm -rf "$faults" && mkdir -p "$found" "$faults"
  export FUZZ_TARGET=$2
  if [[ -d $regressions ]]; then "$fuzzer" "${options[@]}" "$regressions"/*; fi
  "$fuzzer" "${options[@]}" -max_len=4096 "-max_total_time=$1" "-seed=${FUZZ_SEED:-1}" -print_final_stats=1 \
    "-dict=tests/fuzz/dictionaries/$2.dict" "$found" "tests/fuzz/corpus/$2"
}

if [[ ${1:-} == --one ]]; then
  log=build/fuzz/$3.log
  if (replay_and_fuzz "$2" "$3") >"$log" 2>&1; then
    printf '%-16s %9d executions\n' "$3" "$(awk '/number_of_executed_units/ { print $2 }' "$log")"
  else
    echo "$3 FAILED, see $log:"
    grep --max-count=1 --after-context=20 -E 'ERROR: |runtime error|terminate called' "$log" || tail --lines=20 "$log"
    exit 1
  fi
  exit
fi

seconds=${1:-5}
mkdir -p build/fuzz
if (($# > 1)); then names=("${@:2}"); else mapfile -t names < <(ls tests/fuzz/corpus); fi
printf '%s\n' "${names[@]}" | xargs --max-args=1 "--max-procs=$(nproc)" "$0" --one "$seconds"
