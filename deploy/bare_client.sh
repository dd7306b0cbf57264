#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/bare_client.sh
#
# Installs the C++ client in a bare Debian 12 that has the packages of deploy/packages/client.txt only, builds
# client_sdk/examples/strike against it there, and has that strike a bar of a daemon that runs outside.
# Fails unless the daemon renders sound. Needs what deploy/bare_debian.sh needs, and the release preset built.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
bin=$root/build/release/bin
scratch=$(mktemp -d "${TMPDIR:-/tmp}/carillon-bare-client.XXXXXX")
started=()
clean_up() {
  for process in "${started[@]}"; do
    kill "$process" 2>/dev/null || true
    wait "$process" || true
  done
  rm -rf "$scratch"
}
trap clean_up EXIT

# The tree has the network of this machine, so it reaches the loopback interface.
"$bin/carillond" --data-dir "$scratch/data" --listen 127.0.0.1:0 --audio-device null >"$scratch/said" &
started=("$!" "${started[@]}")  # the last one started ends first
for _ in {1..100}; do
  if grep -q '^listening on ' "$scratch/said"; then break; fi
  sleep 0.1
done
CARILLON_SERVER=$(sed -n 's/^listening on //p' "$scratch/said")
export CARILLON_SERVER

"$bin/carillon" example bar --out "$scratch/bar.obj"
model=$("$bin/carillon" model create "$scratch/bar.obj" --material bell_bronze --wait)

# Until it is struck, the daemon plays nothing but zeros.
"$bin/carillon" listen | tr -d '\0' >"$scratch/sound" &
started=("$!" "${started[@]}")  # the last one started ends first
"$root/deploy/bare_debian.sh" ./deploy/client.sh \
  "cmake -G Ninja -S client_sdk/examples/strike -B build/strike && cmake --build build/strike" \
  "CARILLON_SERVER=$CARILLON_SERVER build/strike/strike $model"
if [[ ! -s $scratch/sound ]]; then
  printf 'bare_client: the daemon played nothing\n' >&2
  exit 1
fi
printf 'bare_client: the strike was heard\n'
