#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/demo.sh [ARGUMENTS OF deploy/demo/wind_chimes.sh...]
#
# Installs what is missing, builds the programs, and lets six wind chimes be heard.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

"$root/deploy/build.sh" release carillond carillon-precompute carillon carillon-wind-chimes
exec "$root/deploy/demo/wind_chimes.sh" "$@"
