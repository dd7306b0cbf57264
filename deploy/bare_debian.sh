#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/bare_debian.sh [--copy FOLDER] [COMMAND...]
#
# Makes a bare Debian 12 in a temporary folder, copies the committed checkout (or, instead of it, the content of FOLDER)
# into it and runs the commands there, by default README's two: ./deploy/test.sh and ./deploy/demo.sh. Needs root (or to
# be in a container that lets one mount) and the package mmdebstrap. Leaves nothing behind.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# Mounts and processes of what follows end with this script.
if [[ -z ${CARILLON_BARE_INSIDE:-} ]]; then
  exec env CARILLON_BARE_INSIDE=1 unshare --mount --pid --fork --kill-child --propagation private "$0" "$@"
fi

copied=
if [[ ${1:-} == --copy ]]; then copied=${2:?bare_debian.sh: --copy needs a folder} && shift 2; fi
if (($# == 0)); then set -- ./deploy/test.sh ./deploy/demo.sh; fi
tree=$(mktemp --directory --tmpdir="${TMPDIR:-/var/tmp}" carillon-bare-XXXXXX)
# What runs here is all below this script, the first process of its namespace.
clean_up() {
  if (($$ == 1)); then kill -KILL -1 2>/dev/null || true; fi
  umount --recursive --lazy "$tree"/{proc,sys,dev} 2>/dev/null || true
  rm -rf --one-file-system "$tree"
}
trap clean_up EXIT
chmod 755 "$tree"

# Debian from wherever this machine has it.
# shellcheck disable=SC2016  # apt fills these in
apt-get indextargets --format '$(ORIGIN) deb $(REPO_URI) $(RELEASE) main' 'Created-By: Packages' |
  sed -n 's/^Debian \(deb .* bookworm.*\)$/\1/p' | sort -u |
  mmdebstrap --quiet --variant=minbase bookworm "$tree" -
mkdir -p "$tree/src/carillon"
if [[ -n $copied ]]; then
  cp -r "$copied/." "$tree/src/carillon"
else
  git -c safe.directory="$root" -C "$root" archive HEAD | tar -x -C "$tree/src/carillon"
fi

# The way to the registries is the machine's affair, so it is taken from there.
cp /etc/resolv.conf "$tree/etc/"
# An installed Debian knows its own name.
printf '127.0.0.1 localhost %s\n' "$(hostname -s)" >"$tree/etc/hosts"
registries=()
if command -v npm >/dev/null; then
  registries+=(npm_config_registry="$(npm config get registry --loglevel=silent)")
  authorities=$(npm config get cafile --loglevel=silent)
  if [[ -f $authorities ]]; then
    cp "$authorities" "$tree/etc/npm-authorities.crt"
    registries+=(npm_config_cafile=/etc/npm-authorities.crt)
  fi
fi

mount -t proc proc "$tree/proc"
mount -t sysfs sysfs "$tree/sys" || true
mount --rbind /dev "$tree/dev"

for command in "$@"; do
  printf 'bare_debian: %s\n' "$command"
  SECONDS=0
  env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "${registries[@]}" \
    chroot "$tree" /bin/bash -c "cd /src/carillon && $command" </dev/null
  printf 'bare_debian: %s took %d s\n' "$command" "$SECONDS"
done
