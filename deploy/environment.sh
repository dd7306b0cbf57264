# shellcheck shell=bash
# SPDX-License-Identifier: Apache-2.0
#
# Sourced by the scripts of deploy/ with $root set: what they all need to run anywhere, in a chroot
# without a home or a locale too.

root=${root:?}
export LC_ALL=C.UTF-8
if [[ -z ${HOME:-} || ! -w $HOME ]]; then
  export HOME=$root/build/home
  mkdir -p "$HOME"
fi

# Checkouts in different folders share compiled objects. What is not there yet is compiled at once: without this ccache
# would run the preprocessor first, which costs a tenth of a build from nothing.
export CCACHE_BASEDIR=${CCACHE_BASEDIR-$root} CCACHE_NOHASHDIR=1 CCACHE_DEPEND=1

# Caches that outlive a checkout.
export CARILLON_CACHE=${XDG_CACHE_HOME:-$HOME/.cache}/carillon

case $(uname -m) in
  aarch64) buf_package=buf-linux-aarch64 ;;
  *) buf_package=buf-linux-x64 ;;
esac
buf_lock=$(sha256sum "$root/deploy/buf/package-lock.json" | cut -c 1-16)
export CARILLON_BUF=$CARILLON_CACHE/buf-$buf_lock/node_modules/@bufbuild/$buf_package/bin/buf
node_lock=$(sha256sum "$root/client_sdk/node/package-lock.json" | cut -c 1-16)
export CARILLON_NODE_MODULES=$CARILLON_CACHE/node-$node_lock/node_modules
engines_lock=$(sha256sum "$root/client_sdk/adapters/package-lock.json" | cut -c 1-16)
export CARILLON_ENGINE_MODULES=$CARILLON_CACHE/engines-$engines_lock/node_modules
console_lock=$(sha256sum "$root/client_sdk/console/ui/package-lock.json" | cut -c 1-16)
export CARILLON_CONSOLE_MODULES=$CARILLON_CACHE/console-$console_lock/node_modules
