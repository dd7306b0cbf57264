#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/demo.sh [ARGUMENTS OF deploy/demo/wind_chimes.sh...]
#
# Installs what is missing for the programs, builds them, and lets six wind chimes be heard.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

"$root/deploy/setup.sh" programs
# A build folder that has the tests keeps them; a new one needs none, nor their packages.
options=()
if [[ ! -f $root/build/release/CMakeCache.txt ]]; then options=(-DCARILLON_TESTS=OFF -DCARILLON_BENCHMARKS=OFF); fi
"$root/deploy/build.sh" release "${options[@]}" \
  carillond carillon-precompute carillon carillon-wind-chimes carillon_python
exec "$root/deploy/demo/wind_chimes.sh" "$@"
