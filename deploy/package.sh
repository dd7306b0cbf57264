#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/package.sh [--version VERSION] [--built BUILD] [FOLDER]
#
# Builds the release preset and makes Debian packages of it in FOLDER, by default build/packages, which apt can use as
# a repository, with the archive of the source that belongs to them. The add-on for Blender comes as a zip, too, and the
# client for Python as a wheel for every system. VERSION is that of CMakeLists.txt unless it is given. lintian checks
# the packages of the project's own version, and its errors fail the script. With --built, the programs are taken from
# the folder BUILD as they are, and no package is installed for building them.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"

own_version=$(sed -n 's/^project(carillon VERSION \([0-9.]*\) .*/\1/p' "$root/CMakeLists.txt")
version=$own_version
if [[ ${1:-} == --version ]]; then version=${2:?package.sh: --version needs a number} && shift 2; fi
CARILLON_BUILD=
if [[ ${1:-} == --built ]]; then CARILLON_BUILD=$(cd "${2:?package.sh: --built needs a folder}" && pwd) && shift 2; fi
mkdir -p "${1:-$root/build/packages}"
folder=$(cd "${1:-$root/build/packages}" && pwd)

if [[ -z $CARILLON_BUILD ]]; then
  "$root/deploy/setup.sh" programs packages
  "$root/deploy/build.sh" release carillond carillon carillon-console carillon-precompute carillon_client
  CARILLON_BUILD=$root/build/release
fi
export CARILLON_BUILD

# debhelper wants a folder of its own, with debian/ in it and the packages beside it.
scratch=$(mktemp -d "${TMPDIR:-/tmp}/carillon-package.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
source=$scratch/carillon-$version
mkdir "$source"
cd "$root"
git ls-files -z --cached --others --exclude-standard | tar --null --ignore-failed-read -T - -c | tar -x -C "$source"
find "$source" -exec touch --no-dereference --date="@$(git log -1 --format=%ct)" {} +
tar -cJf "$folder/carillon_$version.tar.xz" -C "$scratch" --sort=name --owner=0 --group=0 "carillon-$version"

# The zip needs neither a build nor debhelper.
cp -r "$source/client_sdk/blender" "$scratch/carillon_blender"
(cd "$scratch" && python3 -m zipfile -c "$folder/carillon_blender-$version.zip" carillon_blender)

debian=$source/debian
cp -r "$source/deploy/debian" "$debian"
sed "s/@VERSION@/$version/" "$debian/SOURCE.in" >"$debian/SOURCE"
sed -e 's/^$/./' -e 's/^/ /' "$root/precompute/LICENSE" |
  sed -e '/^@AGPL@$/{r /dev/stdin' -e 'd}' "$debian/copyright.in" >"$debian/copyright"
cat >"$debian/changelog" <<CHANGELOG
carillon ($version) bookworm; urgency=medium

  * CHANGELOG.md in the documentation of the package carillon lists the changes.

 -- $(sed -n 's/^Maintainer: //p' "$debian/control")  $(git log -1 --format=%aD)
CHANGELOG

cd "$source"
dpkg-buildpackage --build=binary --no-sign --no-check-builddeps >"$scratch/log" 2>&1 || {
  cat "$scratch/log" >&2
  exit 1
}
[[ $version != "$own_version" ]] || lintian --fail-on error --tag-display-limit 0 "$scratch"/*.deb
cp "$scratch"/*.deb "$folder"
(cd "$source/client_sdk/python" && /usr/bin/python3 setup.py --quiet bdist_wheel --dist-dir "$folder" >/dev/null)
# The indexes let apt use the folder as a repository.
cd "$folder"
rm -f Release
apt-ftparchive packages . >Packages
apt-ftparchive release . >"$scratch/Release"
cp "$scratch/Release" .
printf 'package: %s\n' "$folder"/*_"$version"_*.deb "$folder/carillon_$version.tar.xz" \
  "$folder/carillon_blender-$version.zip" "$folder"/carillon-*.whl
printf 'apt: echo "deb [trusted=yes] file:%s ./" > /etc/apt/sources.list.d/carillon.list\n' "$folder"
