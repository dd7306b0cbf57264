#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/bare_container.sh [BUILD]
#
# Makes the Debian packages from the programs in BUILD, by default build/release, builds deploy/container/Containerfile
# with them on a bare Debian 12, and runs tests/deploy/use_container.sh in the container. Needs root, and the packages
# of deploy/packages/{packages,bare}.txt. Leaves nothing behind. Ends with 77, which ctest takes for a
# skipped test, where the caller is not root.
set -euo pipefail
if [[ $(id -u) != 0 ]]; then
  printf 'bare_container: only root can make a bare Debian\n' >&2
  exit 77
fi
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=${1:-$root/build/release}
scratch=$(mktemp -d "${TMPDIR:-/var/tmp}/carillon-bare-container.XXXXXX")
trap 'rm -rf "$scratch"' EXIT
store() { buildah --storage-driver vfs --root "$scratch/root" --runroot "$scratch/run" "$@"; }

"$root/deploy/package.sh" --built "$build" "$scratch/packages"
# Debian from wherever this machine has it.
# shellcheck disable=SC2016  # apt fills these in
apt-get indextargets --format '$(ORIGIN) deb $(REPO_URI) $(RELEASE) main' 'Created-By: Packages' |
  sed -n 's/^Debian \(deb .* bookworm.*\)$/\1/p' | sort -u |
  mmdebstrap --quiet --variant=minbase bookworm "$scratch/debian.tar" -
debian=$(store from scratch)
store add "$debian" "$scratch/debian.tar" / >/dev/null
store commit --quiet "$debian" localhost/debian:12 >/dev/null

store bud --isolation chroot --network host --build-arg DEBIAN=localhost/debian:12 --tag carillon \
  --file "$root/deploy/container/Containerfile" "$scratch/packages"
container=$(store from localhost/carillon)
store run --isolation chroot --network host --volume "$root/tests/deploy/use_container.sh:/use_container.sh:ro" \
  "$container" -- /bin/bash /use_container.sh
