#!/usr/bin/env bash
# Installs the missing packages of the named groups of packages.txt on Debian 12: install-packages.sh GROUP…
set -euo pipefail

list="$(dirname "$(readlink -f "$0")")/packages.txt"
# Slim Debian images leave out /usr/share/doc, where libcgal-demo has its models.
readonly apt_options=(
  --yes --no-install-recommends
  -o DPkg::Lock::Timeout=300
  -o DPkg::Options::=--path-include=/usr/share/doc/libcgal-dev/*
)

usage() {
  echo "usage: $0 GROUP…  (groups: $(sed -n 's/^\[\(.*\)\]$/\1/p' "$list" | paste -sd' '))" >&2
  exit 2
}

# Prints the packages of a group, except those whose command already exists.
packages_of() {
  local package command
  while read -r package command; do
    if [[ -z $command ]] || ! command -v "${command#\?}" >/dev/null; then echo "$package"; fi
  done < <(awk -v group="[$1]" '/^\[/ { inside = ($1 == group); next } { sub(/#.*/, "") } inside && NF' "$list")
}

is_installed() {
  [[ $(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]
}

as_root() {
  if [[ $(id -u) == 0 ]]; then
    env DEBIAN_FRONTEND=noninteractive "$@"
  elif command -v sudo >/dev/null; then
    sudo env DEBIAN_FRONTEND=noninteractive "$@"
  else
    echo "$0: run as root, or install sudo; needed: ${missing[*]}" >&2
    exit 1
  fi
}

(($# > 0)) || usage
missing=()
for group in "$@"; do
  grep -qxF "[$group]" "$list" || usage
  for package in $(packages_of "$group"); do
    is_installed "$package" || missing+=("$package")
  done
done

if ((${#missing[@]} > 0)); then
  echo "Installing ${missing[*]}" >&2
  as_root apt-get update --quiet
  as_root apt-get install --quiet "${apt_options[@]}" "${missing[@]}"
fi
