#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Runs in a container made from deploy/container/Containerfile, as its user: starts the daemon with the image's own
# arguments, makes a model, strikes it, and fails where the strike is not heard or the daemon does not end well.
set -euo pipefail
cd "$(mktemp -d)"

fail() {
  printf 'use_container: %s\n' "$*" >&2
  cat daemon.log >&2
  exit 1
}

[[ $(id -un) == carillon ]] || fail "the image runs its daemon as $(id -un)"
carillond --audio-device=null >daemon.out 2>daemon.log &
daemon=$!
for _ in {1..100}; do
  if grep -qs '^listening on unix:/run/carillon/carillond.sock$' daemon.out; then break; fi
  sleep 0.1
done
carillon example bar
carillon model create bar.obj --material bell_bronze --wait
carillon listen --seconds 3 --out heard.wav &
listener=$!
sleep 0.5
carillon strike bar --point 0.1,0.015,0.008 --impulse 0,0,-0.01 --seconds 1
wait "$listener"
# A second of silence in 24 bits is nothing but zeros; a bronze bar rings for longer.
(($(tail -c +100 heard.wav | tr -d '\0' | wc -c) > 50000)) || fail "the strike is not in heard.wav"
kill "$daemon"
wait "$daemon" || fail "carillond ended with $?"
[[ -s /var/lib/carillon/carillon.db ]] || fail "the database is not in the volume"
printf 'use_container: made a model and heard its strike\n'
