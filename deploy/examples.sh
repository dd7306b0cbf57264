#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/examples.sh NAME [--engine bullet|ode|mujoco|rapier|havok] [ARGUMENTS OF client_sdk/examples/falls/run.py...]
#
# Installs what is missing, builds, simulates the example NAME (blocks, boxes, letters, bowl or wooden_bowl) in the
# engine, and leaves its contact trace, sound, spectrogram and spectrum in build/release/examples.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
if [[ ! ${1:-} =~ ^[a-z] ]]; then
  sed -n '4,7s/^# \{0,1\}//p' "$0" >&2
  exit 2
fi

"$root/deploy/setup.sh" programs engines
"$root/deploy/build.sh" release carillond carillon carillon-precompute carillon-fall carillon_python
exec /usr/bin/python3 "$root/client_sdk/examples/falls/run.py" --build "$root/build/release" "$@"
