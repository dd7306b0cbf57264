#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/build.sh PRESET [TARGET...]: sets up and builds; without targets, everything.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
preset=${1:?usage: deploy/build.sh PRESET [TARGET...]}
shift

"$root/deploy/setup.sh"
cd "$root"
cmake --preset "$preset" --log-level=WARNING
cmake --build --preset "$preset" --parallel "$(nproc)" ${@:+--target "$@"}
