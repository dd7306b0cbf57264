#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/bare_packages.sh [BUILD]
#
# Makes the Debian packages twice from the programs in BUILD, by default build/release: as the version before and as
# this one. tests/deploy/installed_links.py finds the dead links in their pages. tests/deploy/use_packages.sh then
# installs, upgrades, uses, removes and purges them in a bare Debian 12.
# Needs what deploy/bare_debian.sh needs, and the packages of deploy/packages/{packages,bare}.txt. Ends with 77, which
# ctest takes for a skipped test, where the caller is not root.
set -euo pipefail
if [[ $(id -u) != 0 ]]; then
  printf 'bare_packages: only root can make a bare Debian\n' >&2
  exit 77
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${1:-$root/build/release}
scratch=$(mktemp -d "${TMPDIR:-/tmp}/carillon-bare-packages.XXXXXX")
trap 'rm -rf "$scratch"' EXIT

"$root/deploy/package.sh" --version 0.0.1 --built "$build" "$scratch/before"
"$root/deploy/package.sh" --built "$build" "$scratch/now"
for package in "$scratch"/now/*.deb; do dpkg-deb --extract "$package" "$scratch/unpacked"; done
"$root/tests/deploy/installed_links.py" "$scratch/unpacked"
rm -r "$scratch/unpacked"
cp "$root"/tests/deploy/{use_packages.sh,type_page.py} "$scratch"
"$root/deploy/bare_debian.sh" --copy "$scratch" ./use_packages.sh
