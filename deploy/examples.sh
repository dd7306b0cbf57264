#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/examples.sh NAME [--engine bullet|ode|mujoco|rapier|havok] [--video] [ARGUMENTS OF falls/run.py...]
# deploy/examples.sh clips [--count N] [--stems] [ARGUMENTS OF falls/clips.py...]
# deploy/examples.sh gallery [--only PART...]
#
# Installs what is missing, builds, simulates the example NAME (blocks, boxes, letters, bowl, wooden_bowl, bunnies or
# chimes) in the engine, and leaves its contact trace, sound, spectrogram, spectrum and video in
# build/release/examples. With `clips` it simulates N random falls in MuJoCo, and leaves their sounds and a manifest in
# build/release/examples/clips (docs/clips.md). With `gallery` it makes the sounds, pictures and film of docs/ again
# (client_sdk/examples/falls/gallery.py). The programs are in client_sdk/examples.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
if [[ ! ${1:-} =~ ^[a-z] ]]; then
  sed -n '4,12s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi

lists=(programs engines)
run=(/usr/bin/python3 "$root/client_sdk/examples/falls/run.py")
if [[ $1 == clips ]]; then
  shift
  run=(/usr/bin/python3 "$root/client_sdk/examples/falls/clips.py")
elif [[ $1 == gallery ]]; then
  shift
  run=(/usr/bin/python3 "$root/client_sdk/examples/falls/gallery.py")
fi
if [[ ${run[1]} == */gallery.py || " $* " == *" --video "* ]]; then
  lists+=(videos)
  run=(xvfb-run -a -s "-screen 0 640x480x24" "${run[@]}")
fi
"$root/deploy/setup.sh" "${lists[@]}"
"$root/deploy/build.sh" release \
  carillond carillon carillon-precompute carillon-fall carillon-wind-chimes carillon_python
exec "${run[@]}" --build "$root/build/release" "$@"
