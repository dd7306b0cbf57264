#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/truth.sh [RECORDINGS] [ARGUMENTS OF tests/benchmarks/truth/run.py...]
#
# Compares Carillon's sound with recordings of known bodies, of which RECORDINGS is the folder (../shared/recordings
# beside the root where it is there). Installs what is missing, builds, renders, prints tables, and draws spectrograms
# into build/release/truth. Where a recording is missing it says so and does the rest.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
recordings=$root/../shared/recordings
if [[ ${1:-} && $1 != -* ]]; then
  recordings=$1
  shift
fi

"$root/deploy/setup.sh" programs "$root/tests/benchmarks/truth/packages.txt"
"$root/deploy/build.sh" release carillond carillon carillon-precompute carillon_python
exec /usr/bin/python3 "$root/tests/benchmarks/truth/run.py" --build "$root/build/release" \
  --recordings "$recordings" "$@"
