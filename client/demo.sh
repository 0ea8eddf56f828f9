#!/usr/bin/env bash
# demo.sh [MESH]: installs and builds everything, starts creased and smooths a mesh with curl. Leaves result.glb and
# labels.json in the current folder and prints the figures. Without MESH it uses a fandisk with added noise, so that the
# result can be compared with the true shape.
set -euo pipefail

root="$(dirname "$(dirname "$(readlink -f "$0")")")"
readonly root bin="$root/build/release/bin"
readonly models=/usr/share/doc/libcgal-dev/data.tar.gz model=data/meshes/fandisk.off

say() { echo "== $*" >&2; }

build() {
  say "Building in $root/build/release"
  if [[ ! -e $root/build/release/build.ninja ]]; then (cd "$root" && cmake --preset release >&2); fi
  cmake --build "$root/build/release" --target creased crease >&2
}

# Writes the reference and the noisy mesh to the work folder.
make_noisy_fandisk() {
  tar --extract --gzip --file "$models" --to-stdout --wildcards "*$model" >"$work/fandisk.off"
  "$bin/crease" noise "$work/fandisk.off" -o "$work/fandisk_noisy.obj" --sigma 0.3 --kind normal --seed 1 >&2
}

start_server() {
  "$bin/creased" serve --port 0 --port-file "$work/port" --data-dir "$work/data" >"$work/creased.log" 2>&1 &
  server=$!
  while [[ ! -s $work/port ]]; do
    if ! kill -0 "$server" 2>/dev/null; then
      cat "$work/creased.log" >&2
      exit 1
    fi
    sleep 0.05
  done
  url="http://127.0.0.1:$(<"$work/port")"
}

clean_up() {
  if [[ -n ${server:-} ]]; then
    kill "$server" 2>/dev/null || true
    wait "$server" 2>/dev/null || true
  fi
  rm -rf "$work"
}

# Uploads the file and prints the job.
upload() {
  local answer="$work/answer.json" status
  status="$(curl --silent --show-error --output "$answer" --write-out '%{http_code}' \
    --form "mesh=@\"$1\"" "$url/v1/jobs")"
  if [[ $status != 202 ]]; then
    echo "The upload was refused ($status): $(jq -r '"\(.code): \(.detail) \(.place // "")"' "$answer")" >&2
    exit 1
  fi
  cat "$answer"
}

# Follows the events of a job to its end and prints the job.
follow() {
  local event="" key value shown=-1 percent
  while IFS=': ' read -r key value; do
    if [[ $key == event ]]; then event=$value; fi
    if [[ $key != data ]]; then continue; fi
    if [[ $event != progress ]]; then
      echo "$value"
      return
    fi
    percent="$(jq '.fraction * 100 | floor' <<<"$value")"
    if ((percent >= shown + 10)); then
      jq -r '"   \(.stage) \(.fraction * 100 | floor) %  sweep \(.sweep)/\(.sweeps)"' <<<"$value" >&2
      shown=$percent
    fi
  done < <(curl --silent --no-buffer "$url/v1/jobs/$1/events")
  echo "The events ended before the job did." >&2
  exit 1
}

normal_error() { "$bin/crease" measure "$@" --json | jq -r '.mean_normal_error_deg * 100 | round / 100'; }

print_figures() {
  jq -r 'def rounded: . * 1000 | round / 1000;
    "vertices, faces      \(.input.vertices), \(.input.faces)",
    "ridges found         \(.result.ridge_edges) edges",
    "displacement, rms    \(.result.rms_displacement | rounded) edge lengths",
    "displacement, max    \(.result.max_displacement | rounded) edge lengths",
    "smoothing took       \(.result.seconds | rounded) s"' <<<"$1"
}

print_errors() {
  local reference="$work/fandisk.off" f1
  f1="$("$bin/crease" measure "$reference" "$work/result.ply" --labels labels.json --json |
    jq '.labels.f1 * 1000 | round / 1000')"
  echo "normal error before  $(normal_error "$reference" "$1")°"
  echo "normal error after   $(normal_error "$reference" "$work/result.ply")°"
  echo "ridge F1             $f1"
}

if (($# > 1)); then
  echo "usage: $0 [MESH]" >&2
  exit 2
fi
if (($# == 1)) && [[ ! -r $1 ]]; then
  echo "$0: cannot read $1" >&2
  exit 2
fi

"$root/docker/install-packages.sh" build demo >&2
build
work="$(mktemp -d)"
trap clean_up EXIT
if (($# == 1)); then
  input="$1"
else
  say "Making a noisy fandisk"
  make_noisy_fandisk
  input="$work/fandisk_noisy.obj"
fi

start_server
say "creased listens on $url"
job="$(upload "$input")"
id="$(jq -r .id <<<"$job")"
say "Job $id"
job="$(follow "$id")"
if [[ $(jq -r .state <<<"$job") != succeeded ]]; then
  echo "The job did not succeed: $(jq -c .error <<<"$job")" >&2
  exit 1
fi
curl --silent --show-error --fail --output result.glb "$url/v1/jobs/$id/mesh?format=glb"
curl --silent --show-error --fail --output labels.json "$url/v1/jobs/$id/labels?format=json"

print_figures "$job"
if (($# == 0)); then
  curl --silent --show-error --fail --output "$work/result.ply" "$url/v1/jobs/$id/mesh?format=ply"
  print_errors "$input"
fi
echo "output               result.glb, labels.json"
