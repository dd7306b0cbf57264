#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/paper.sh [ARGUMENTS OF tests/benchmarks/paper/run.py...]
#
# Computes Tables 1 and 2 and figures 3 to 5 of the paper (O'Brien, Shen, Gatchalian 2002) anew, and its sound model
# beside Carillon's, and writes docs/REPRODUCTION.md with its pictures. Installs what is missing, and builds, first.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

"$root/deploy/setup.sh" programs "$root/tests/benchmarks/paper/packages.txt"
"$root/deploy/build.sh" release carillond carillon carillon-precompute carillon_python
exec /usr/bin/python3 "$root/tests/benchmarks/paper/run.py" --build "$root/build/release" "$@"
