#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/bench.sh NAME [ARGUMENTS OF tests/benchmarks/NAME/run.py...]
#
# Installs what is missing, the programs compared with too, builds, runs all of them in turn on the
# same input, and prints one table.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
benchmark=$root/tests/benchmarks/${1:-}
if [[ ! -f $benchmark/run.py ]]; then
  printf 'usage: %s NAME [ARGUMENTS...], with NAME one of:' "$0" >&2
  for run in "$root"/tests/benchmarks/*/run.py; do printf ' %s' "$(basename "${run%/*}")" >&2; done
  printf '\n' >&2
  exit 2
fi
shift

"$root/deploy/setup.sh" programs tests "$benchmark/packages.txt"
"$root/deploy/build.sh" release -DCARILLON_TESTS=ON -DCARILLON_BENCHMARKS=ON
exec /usr/bin/python3 "$benchmark/run.py" --build "$root/build/release" "$@"
