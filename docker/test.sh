#!/usr/bin/env bash
# Builds the image without a Docker daemon and runs it as an operator would: docker/test.sh [scale]
# Read-only and without capabilities: open and with keys, on another port, within the limits of its cgroup; a job goes
# through it, and one whose container is killed in the middle is done after the restart. With scale, starts
# docker/compose.scale.yaml instead: test-scale.sh. Needs root. CREASED_IMAGE=NAME takes an image that is there already.
set -euo pipefail

cd "$(dirname "$(readlink -f "$0")")/.."
readonly base=docker.io/library/debian:bookworm-slim image=${CREASED_IMAGE:-localhost/creased-test}
readonly name=creased-test-$$ port=$((20000 + $$ % 20000))
work=$(mktemp --directory)
readonly work data=$work/data

# The defaults of podman may be beyond the machine's own, which no container may have.
readonly limits=(--ulimit nofile=20000:20000 --ulimit nproc=32768:32768)

podman_() { podman --runtime runc --cgroup-manager cgroupfs "$@"; }
say() { echo "--- $*"; }
fail() {
  echo "FAILED: $*" >&2
  podman_ logs "$name" >&2 2>/dev/null || true
  exit 1
}
clean() {
  podman_ rm --force "$name" >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap clean EXIT

# A base image from the packages of this machine's mirror, with its way to reach it. It stays on this machine.
make_base() {
  local root=$work/root mirror
  # shellcheck disable=SC2016
  mirror=$(apt-get indextargets --format '$(REPO_URI)' | sort | uniq --count | sort --numeric --reverse | awk 'NR == 1 { print $2 }')
  debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/debootstrap.log" ||
    { cat "$work/debootstrap.log" >&2 && exit 1; }
  cp --recursive --remove-destination /etc/apt/. "$root/etc/apt/"
  cp /etc/hosts /etc/resolv.conf "$root/etc/"
  if [[ -d /usr/local/share/ca-certificates ]]; then
    cp --recursive /etc/ssl/certs /usr/local/share/ca-certificates "$work/" && mkdir --parents "$root/etc/ssl"
    cp --recursive "$work/certs" "$root/etc/ssl/"
  fi
  tar --directory "$root" --create . | podman import - "$base" >/dev/null
}

# build IMAGE DOCKERFILE FOLDER
build() {
  podman image exists "$base" || make_base
  buildah --storage-driver overlay bud --format docker --isolation chroot --network host --pull-never \
    --tag "$1" --file "$2" "$3" >"$work/build.log" 2>&1 || { tail --lines 40 "$work/build.log" >&2 && exit 1; }
}

# run [OPTION…] [-- ARGUMENT…]: starts the container, read-only, with its data in a folder of this machine.
run() {
  local options=()
  while (($# > 0)) && [[ $1 != -- ]]; do options+=("$1") && shift; done
  (($# == 0)) || shift
  podman_ rm --force "$name" >/dev/null 2>&1 || true
  podman_ run "${limits[@]}" --detach --name "$name" --network host --read-only --tmpfs /tmp:size=64m --cap-drop all \
    --security-opt no-new-privileges --volume "$data:/data" --env CREASED_PORT="$port" "${options[@]}" "$image" "$@" \
    >/dev/null 2>"$work/run.log" || { cat "$work/run.log" >&2 && exit 1; }
  for _ in {1..200}; do
    if curl --silent --fail --output /dev/null "localhost:$port/readyz"; then return; fi
    podman_ container inspect --format '{{.State.Running}}' "$name" | grep --quiet true || break
    sleep 0.1
  done
  fail "the container is not ready"
}

field() { jq --raw-output "$1"; }

if [[ -z ${CREASED_IMAGE:-} ]]; then
  docker/install-packages.sh image demo
  say "building the image" && build "$image" docker/Dockerfile .
fi
if [[ ${1:-} == scale ]]; then
  # shellcheck source=docker/test-scale.sh
  . docker/test-scale.sh
  exit
fi
mkdir "$data" && chown 10001:10001 "$data" && chmod 0700 "$data"
podman image inspect --format 'size {{.Size}} bytes, user {{.User}}, command {{.Config.Cmd}}' "$image"

say "open, read-only, without capabilities: a job"
run
curl --silent --fail "localhost:$port/v1/samples/part.ply" --output "$work/part.ply"
job=$(curl --silent --fail --header 'Prefer: wait=60' --data-binary "@$work/part.ply" \
  --header 'Content-Type: model/ply' "localhost:$port/v1/jobs?name=part.ply")
[[ $(field .state <<<"$job") == succeeded ]] || fail "the job has not succeeded: $job"
curl --silent --fail "localhost:$port/v1/jobs/$(field .id <<<"$job")/mesh.glb" --output "$work/part.glb"
echo "job $(field .id <<<"$job") succeeded, its mesh has $(stat --format %s "$work/part.glb") bytes"

say "the health check of the image follows CREASED_PORT"
podman_ container inspect --format '{{json .Config.Healthcheck.Test}}' "$name"
# shellcheck disable=SC2016
podman_ exec "$name" sh -c 'crease health --server "http://127.0.0.1:${CREASED_PORT:-8080}"' || fail "it is not healthy"

say "killed in the middle of a job, and started again"
slow=$(curl --silent --fail --data-binary "@$work/part.ply" --header 'Content-Type: model/ply' \
  "localhost:$port/v1/jobs?name=slow.ply&solver=metropolis&sweeps=3000&seed=7" | field .id)
for _ in {1..600}; do
  sweep=$(curl --silent "localhost:$port/v1/jobs/$slow" | field '.progress.sweep // 0')
  ((sweep < 3)) || break
  sleep 0.05
done
((sweep >= 3 && sweep < 3000)) || fail "the job was not seen running: sweep $sweep"
podman_ kill --signal KILL "$name" >/dev/null
run
for _ in {1..1200}; do
  job=$(curl --silent "localhost:$port/v1/jobs/$slow")
  [[ $(field .state <<<"$job") == queued || $(field .state <<<"$job") == running ]] || break
  sleep 0.25
done
[[ $(field .state <<<"$job") == succeeded ]] || fail "the job is not done after the restart: $job"
echo "killed at sweep $sweep, succeeded in attempt $(field .attempt <<<"$job")"

say "arguments replace none of the image's settings"
run -- serve --workers 2
workers=$(podman_ top "$name" args | grep --count 'creased worker' || true)
((workers == 2)) || fail "$workers workers run, expected 2"

say "with keys"
podman_ run "${limits[@]}" --rm --network none "$image" key alice >"$work/key.txt"
mkdir "$work/keys"
head --lines 1 "$work/key.txt" >"$work/key"
tail --lines 1 "$work/key.txt" | jq '{keys: [.]}' >"$work/keys/keys.json"
chmod 0755 "$work" "$work/keys" && chmod 0644 "$work/keys/keys.json"
run --volume "$work/keys:/keys:ro" --env CREASED_KEYS=/keys/keys.json
code=$(curl --silent --output /dev/null --write-out '%{http_code}' "localhost:$port/v1/jobs")
[[ $code == 401 ]] || fail "a call without a key got $code"
code=$(curl --silent --output /dev/null --write-out '%{http_code}' --header "Authorization: Bearer $(cat "$work/key")" "localhost:$port/v1/jobs")
[[ $code == 200 ]] || fail "a call with a key got $code"
echo "without a key 401, with a key 200"

say "stops cleanly"
podman_ stop --time 20 "$name" >/dev/null
code=$(podman_ container inspect --format '{{.State.ExitCode}}' "$name")
[[ $code == 0 ]] || fail "the container ended with $code"
say "all passed"
