#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/demo/wind_chimes.sh [--seconds S] [--seed N]
#
# What deploy/demo.sh shows once all is built: has the six chimes decomposed, swings them in a wind,
# streams every contact to a daemon of its own, and leaves the sound as WAV and as a spectrogram.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
bin=$root/build/release/bin

# Outlives builds, so that a second run finds the models there.
folder=${XDG_DATA_HOME:-$HOME/.local/share}/carillon-demo
seconds=20
seed=1
while (($#)); do
  case $1 in
    --seconds) seconds=${2:?--seconds needs a number} && shift 2 ;;
    --seed) seed=${2:?--seed needs a number} && shift 2 ;;
    *) printf 'usage: %s [--seconds S] [--seed N]\n' "$0" >&2 && exit 2 ;;
  esac
done

notes=(D3 E3 G3 A4 B4 D4)
meshes=$folder/meshes
trace=$folder/wind_chimes.contacts
wav=$folder/wind_chimes.wav
png=$folder/wind_chimes.png
log=$folder/carillond.log
mkdir -p "$meshes"

# A socket's path has little room (108 bytes), and the folder's may be long.
run=$(mktemp -d "${TMPDIR:-/tmp}/carillon-demo.XXXXXX")
export CARILLON_SERVER=unix:$run/carillond.sock
daemon=
stop_daemon() {
  if [[ -n $daemon ]]; then
    kill "$daemon" 2>/dev/null || true
    wait "$daemon" || true
  fi
  rm -rf "$run"
}
trap stop_daemon EXIT

start_daemon() {
  # The chimes shall all sound alike, and the player shall have the processors for itself. They are softer than the
  # bodies for which full scale is 200 Pa.
  "$bin/carillond" --data-dir "$folder/database" --listen "$CARILLON_SERVER" --no-transfers \
    --full-scale-pa 20 >"$log" 2>&1 &
  daemon=$!
  for _ in {1..100}; do
    if "$bin/carillon" status >/dev/null 2>&1; then return; fi
    if ! kill -0 "$daemon" 2>/dev/null; then break; fi
    sleep 0.1
  done
  printf 'demo: carillond did not start:\n' >&2
  tail -n 5 "$log" >&2
  exit 1
}

start_daemon
"$bin/carillon" status

printf '\nThe six chimes of Table 2:\n'
"$bin/carillon-wind-chimes" meshes "$meshes"
models=()
for note in "${notes[@]}"; do
  models+=("$("$bin/carillon" model create "$meshes/$note.obj" --label "$note" \
    --material chime_aluminum)")
done
for model in "${models[@]}"; do "$bin/carillon" job watch "$model" >/dev/null; done

printf '\nSwinging them for %s s, every contact streamed as it happens:\n' "$seconds"
"$bin/carillon-wind-chimes" play --gain 0.5 "${models[@]}" --seconds "$seconds" --seed "$seed" --trace "$trace"

printf '\nThe same contacts, rendered offline:\n'
"$bin/carillon" render "$trace" --full-scale-pa 20 --out "$wav"
"$root/deploy/demo/spectrogram.py" "$wav" "$png"
printf '\nSound:       %s\nSpectrogram: %s\n' "$wav" "$png"
