#!/usr/bin/env bash
# Formatting and shellcheck over every file of ours: tests/lint.sh
#   format        rewrites the sources instead
#   tidy          clang-tidy over what differs from main, committed or not; on main itself, from the commit before
#   tidy all      over every source;  tidy FILE…  over these
# A header is looked at through one source that includes it. CREASED_TIDY_SECONDS bounds tidy: what would begin later is
# left out, and named.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
readonly rooms=(core proto server client tests)

sources() { find "${rooms[@]}" -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' \) "${@:--print}"; }

lint() {
  sources -print0 | xargs -0 clang-format --dry-run -Werror
  echo "clang-format: clean"
  find "${rooms[@]}" docker -name node_modules -prune -o -name '*.sh' -print0 | xargs -0 shellcheck .ci/run
  echo "shellcheck: clean"
}

format() { sources -print0 | xargs -0 clang-format -i; }

# The commit to compare with.
base() {
  local main
  main=$(git rev-parse --verify --quiet main || git rev-parse --verify --quiet origin/main || git rev-parse HEAD)
  main=$(git merge-base HEAD "$main")
  if [[ $main == $(git rev-parse HEAD) ]]; then git rev-parse --verify --quiet HEAD^ || echo "$main"; else echo "$main"; fi
}

changed() {
  { git diff --name-only --diff-filter=d "$(base)" -- "${rooms[@]}" && git ls-files --others --exclude-standard; } |
    grep -E '^('"$(IFS='|' && echo "${rooms[*]}")"')/.*\.(h|cpp)$' || true
}

# The sources to look at for files on standard input.
translation_units() {
  local file
  while read -r file; do
    if [[ $file == *.cpp ]]; then
      echo "$file"
    elif [[ -f ${file%.h}.cpp ]]; then
      echo "${file%.h}.cpp"
    else
      grep --recursive --files-with-matches --include='*.cpp' "#include \"$file\"" "${rooms[@]}" | sort | head -n 1 || true
    fi
  done | sort --unique
}

tidy() {
  local files headers
  case ${1:-} in
    all) mapfile -t files < <(sources | grep '\.cpp$') ;;
    '') mapfile -t files < <(changed | translation_units) ;;
    *) mapfile -t files < <(printf '%s\n' "$@" | translation_units) ;;
  esac
  if ((${#files[@]} == 0)); then echo "clang-tidy: nothing has changed" && return; fi
  cmake --preset tidy >/dev/null
  headers=(proto/crease/v1/*.proto)
  cmake --build --preset tidy --target "${headers[@]/%.proto/.pb.h}" >/dev/null
  tests/tidy.py "--seconds=${CREASED_TIDY_SECONDS:-inf}" "${files[@]}"
}

case ${1:-lint} in
  lint | format) "${1:-lint}" ;;
  tidy) tidy "${@:2}" ;;
  *) echo "$0: no '$1'" >&2 && exit 2 ;;
esac
