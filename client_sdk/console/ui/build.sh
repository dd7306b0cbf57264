#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# build.sh NODE_MODULES PROTO FOLDER: generates the contract's TypeScript, checks the types, and leaves the compressed
# pages in FOLDER, and the package @carillon/web as FOLDER/carillon-web.tgz.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
modules=$(cd "$1" && pwd)
proto=$(cd "$2" && pwd)
mkdir -p "$3"
folder=$(cd "$3" && pwd)

rm -rf "$folder/ui"
mkdir -p "$folder/ui"
cp -r "$here"/{src,web,index.html,style.css,tsconfig.json,tsconfig.web.json} "$folder/ui"
ln -s "$modules" "$folder/ui/node_modules"
cd "$folder/ui"
rm -rf src/gen
mkdir src/gen
# The programs are called by node, because archives that were fetched without npm have no links to them.
printf '#!/bin/sh\nexec node "%s/@bufbuild/protoc-gen-es/bin/protoc-gen-es"\n' "$modules" >protoc-gen-es
chmod +x protoc-gen-es
protoc -I "$proto" --plugin=protoc-gen-es=./protoc-gen-es --es_out=src/gen --es_opt=target=ts \
  "$proto"/carillon/v1/*.proto
node node_modules/typescript/bin/tsc
bundler=$(echo node_modules/@esbuild/linux-*/bin/esbuild)
# bundle FOLDER FILE...
bundle() {
  "$bundler" "${@:2}" --bundle --minify --format=esm --target=es2022 --outdir="$1" \
    --legal-comments=none --log-level=warning --jsx=automatic --jsx-import-source=preact
}
# What the page and its worker have in common is one file.
bundle "$folder" src/main.tsx src/listen_worker.ts --splitting --chunk-names=shared
bundle "$folder" src/player_worklet.ts
# The page that is mailed has all in one file, with the notices of its libraries.
bundle . src/trace_file.tsx --legal-comments=inline
{
  printf '<!doctype html>\n<html lang="en">\n<meta charset="utf-8">\n<title>Carillon</title>\n<style>\n'
  cat style.css
  printf '</style>\n<script type="module">\n'
  cat trace_file.js
  printf '</script>\n'
} >"$folder/trace_file.html"
bundle web src/web.ts src/listen_worker.ts --splitting --chunk-names=shared
bundle web src/player_worklet.ts
node node_modules/typescript/bin/tsc --project tsconfig.web.json
for package in three preact @preact/signals{,-core} @bufbuild/protobuf @connectrpc/connect; do
  printf '%s\n\n' "$package"
  cat "node_modules/$package"/LICENSE* 2>/dev/null ||
    sed -n 's/^ *"license": *//p' "node_modules/$package/package.json"
  printf '\n\n'
done >"$folder/licences.txt"
cp "$folder/licences.txt" web
tar --create --gzip --file "$folder/carillon-web.tgz" --transform 's,^web,package,' --sort=name --owner=0 --group=0 \
  --numeric-owner --mtime=@0 web
for page in index.html style.css; do cp "$page" "$folder"; done
cd "$folder"
# zopfli's gzip is 4 % smaller, for a second more.
compress=(zopfli --i5)
command -v zopfli >/dev/null || compress=(gzip --best --no-name --force --keep)
for page in {index.html,style.css,{main,listen_worker,shared,player_worklet}.js,licences.txt}; do
  "${compress[@]}" "$page"
done
