#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/setup.sh LIST...
#
# Installs what is missing of the packages in the given lists, from Debian as this machine's apt is set up. A list is
# one of deploy/packages/ (programs, console, engines, videos, tests, languages, packages, bare, lint, fuzz, client) or
# a file. From the npm registry `lint` also installs buf, `tests`, `packages` and `engines` what the client for Node
# needs, `tests` and `engines` the engines that run in Node, and `tests`, `packages` and `console` what builds the
# console's pages.
# Calls neither registry when nothing is missing.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"

lists=()
with_buf=
with_node=
with_engines=
with_console=
for list in "$@"; do
  case $list in
    lint) with_buf=yes ;;
    tests) with_node=yes with_engines=yes with_console=yes ;;
    engines) with_node=yes with_engines=yes ;;
    console) with_console=yes ;;
    packages) with_node=yes with_console=yes ;;
  esac
  if [[ $list == */* ]]; then lists+=("$list"); else lists+=("$root/deploy/packages/$list.txt"); fi
done

missing_packages() {
  local -A installed=()
  local name
  while read -r name; do installed[$name]=1; done < <(
    dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' 2>/dev/null | sed -n 's/^.i  *//p')
  while read -r name; do
    [[ -n ${installed[$name]:-} ]] || printf '%s\n' "$name"
  done < <(sed -e 's/#.*//' -e '/^ *$/d' "${lists[@]}")
}

as_root() {
  if [[ $(id -u) -eq 0 ]]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    printf 'setup: not root and without sudo; as root, run:\n  %s\n' "$*" >&2
    return 1
  fi
}

install_packages() {
  printf 'setup: installing %s\n' "$*"
  local -a apt=(env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 apt-get -q -y
    -o Acquire::Retries=3 -o DPkg::Lock::Timeout=600 -o Dpkg::Use-Pty=0)
  as_root "${apt[@]}" update || printf 'setup: apt-get update failed; trying what is known\n' >&2
  as_root "${apt[@]}" install --no-install-recommends "$@" </dev/null
}

# install_from_npm SOURCE FOLDER PROBE: installs what SOURCE/package-lock.json names into FOLDER, which then has PROBE.
install_from_npm() {
  printf 'setup: installing what %s/package-lock.json names\n' "${1#"$root/"}"
  mkdir -p "$2"
  cp "$1"/package{,-lock}.json "$2"
  # npm knows how this machine reaches the registry. Debian's brings 339 packages, so where there is none, the archives
  # are fetched without it. Both check the digests in the lock file.
  if command -v npm >/dev/null; then
    (cd "$2" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error </dev/null)
  else
    /usr/bin/python3 "$root/deploy/buf/fetch.py" "$1/package-lock.json" "$2"
  fi
  # A package for one platform is optional to npm, so it does not mind when none could be had.
  [[ -e $3 ]] || {
    printf 'setup: npm could not get %s; "npm ping" tells whether it reaches its registry\n' "${3##*/}" >&2
    return 1
  }
}

mapfile -t missing < <(missing_packages)
if ((${#missing[@]})); then install_packages "${missing[@]}"; fi
if [[ -n $with_buf && ! -x $CARILLON_BUF ]]; then
  install_from_npm "$root/deploy/buf" "${CARILLON_BUF%/node_modules/*}" "$CARILLON_BUF"
fi
if [[ -n $with_node && ! -e $CARILLON_NODE_MODULES/@grpc/grpc-js ]]; then
  install_from_npm "$root/client_sdk/node" "${CARILLON_NODE_MODULES%/*}" "$CARILLON_NODE_MODULES/@grpc/grpc-js"
fi
if [[ -n $with_engines && ! -e $CARILLON_ENGINE_MODULES/@babylonjs/havok ]]; then
  install_from_npm "$root/client_sdk/adapters" "${CARILLON_ENGINE_MODULES%/*}" \
    "$CARILLON_ENGINE_MODULES/@babylonjs/havok"
fi
if [[ -n $with_console && ! -e $CARILLON_CONSOLE_MODULES/three ]]; then
  install_from_npm "$root/client_sdk/console/ui" "${CARILLON_CONSOLE_MODULES%/*}" "$CARILLON_CONSOLE_MODULES/three"
fi
