#!/usr/bin/env bash
# Builds the web page: build-page.sh SOURCE WORK OPENAPI OUT. Without npm or a registry the build goes on without a page.
# SOURCE is this folder, WORK a folder to build in, OPENAPI the OpenAPI document, OUT where the page goes.
set -euo pipefail

readonly source=$1 work=$2 openapi=$3 out=$4

without_page() {
  echo "The web page is left out: $1" >&2
  mkdir -p "$out"
  exit 0
}

command -v npm >/dev/null || without_page "npm is not installed"
mkdir -p "$work"
for folder in js web; do
  mkdir -p "$work/$folder"
  (cd "$source/$folder" && find . -type f -not -path './node_modules/*' -not -path './dist/*' -not -name schema.ts) |
    tar --create --directory "$source/$folder" --files-from - | tar --extract --directory "$work/$folder"
done
cp "$source/package.json" "$source/package-lock.json" "$work"
cd "$work"
if ! cmp --silent package-lock.json installed-lock.json; then
  npm ci --no-audit --no-fund --loglevel=error >npm.log 2>&1 || without_page "npm ci failed, see $work/npm.log"
  cp package-lock.json installed-lock.json
fi
CREASED_OPENAPI=$openapi npm run --silent types --workspace js >npm.log 2>&1 || { cat npm.log >&2 && exit 1; }
npm run --silent build --workspace js
CREASED_PAGE_OUT=$out npm run --silent build --workspace web -- --logLevel warn
