#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/build.sh PRESET [-DOPTION=VALUE...] [TARGET...]: configures and builds; without targets, everything.
# deploy/setup.sh installs what that needs.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
preset=${1:?usage: deploy/build.sh PRESET [-DOPTION=VALUE...] [TARGET...]}
shift
options=()
while [[ ${1:-} == -D* ]]; do options+=("$1") && shift; done

cd "$root"
cmake --preset "$preset" --log-level=WARNING "${options[@]}"
cmake --build --preset "$preset" --parallel "$(nproc)" ${@:+--target "$@"}
