#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/client.sh [PREFIX]
#
# Installs the packages that the C++ client needs, builds the client alone, and installs it under PREFIX,
# by default /usr/local. CMake then finds it as find_package(carillon CONFIG), and pkg-config as carillon-client.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"

"$root/deploy/setup.sh" client
cd "$root"
cmake --preset client --log-level=WARNING
cmake --build --preset client --parallel "$(nproc)"
cmake --install build/client --component sdk --prefix "${1:-/usr/local}"
