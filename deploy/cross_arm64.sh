#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/cross_arm64.sh [TARGET...]
#
# Makes a bare Debian 12 with Debian's cross compilers and its libraries for arm64, and builds there the programs and
# the tests of the kernels and of the codecs, or only the given targets. Then it runs the tests that were built under
# qemu-user. Needs what deploy/bare_debian.sh needs.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [[ ${1:-} != --inside ]]; then
  exec "$root/deploy/bare_debian.sh" "./deploy/cross_arm64.sh --inside $*"
fi
shift
targets=("$@")
if ((${#targets[@]} == 0)); then
  targets=(carillond carillon carillon-precompute tests_server_synthesis tests_server_mode_database tests_proto
    tests_client_sdk_interchange)
fi

export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
dpkg --add-architecture arm64
apt-get -q update
# Libraries are wanted for arm64, programs for this machine. Packages for all architectures have none of their own.
packages=(crossbuild-essential-arm64 qemu-user)
while read -r name; do
  case $name in
    g++ | ccache) ;;
    lib* | portaudio19-dev)
      if apt-cache show "$name:arm64" >/dev/null 2>&1; then packages+=("$name:arm64"); else packages+=("$name"); fi
      ;;
    *) packages+=("$name") ;;
  esac
done < <(sed -e 's/#.*//' -e '/^ *$/d' "$root"/deploy/packages/{programs,tests}.txt |
  grep -vE '^(python3|mypy|slurm|munge|glmark2|assimp-utils|jack)')
apt-get -q -y install --no-install-recommends "${packages[@]}"

cd "$root"
cmake --preset release -B build/arm64 --toolchain deploy/cmake/arm64.cmake -DCARILLON_TESTS=ON \
  -DCARILLON_BENCHMARKS=OFF --log-level=WARNING
cmake --build build/arm64 --parallel "$(nproc)" --target "${targets[@]}"
for test in build/arm64/tests/*_test; do
  if [[ -x $test ]]; then qemu-aarch64 "$test" --gtest_brief=1; fi
done
