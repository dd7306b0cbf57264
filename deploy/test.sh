#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/test.sh [--preset release|dev|asan|tsan] [ROOM...] [ARGUMENTS OF ctest...]
#
# Installs what is missing, builds, and runs the tests: all of them, lint too; under asan those of the parsers, codecs,
# synthesis and API, with more time; under tsan those of the audio path, without the sound server, which was compiled
# without the sanitizer. A ROOM is a folder of tests/ or one test in it, such as server/synthesis or
# server/synthesis/mixer_test: only what its tests need is built, and only they run.
# Exits with 77 where the kernel keeps asan or tsan from running.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"

# The rooms whose threads meet the audio thread, and those that read bytes of strangers or index memory by hand.
audio_path=(server/{base,excitation,synthesis,scene,audio_device})
bytes_path=(proto precompute/mesh/read client_sdk/interchange server/{mode_database,synthesis,api})

preset=release
case ${1:-} in
  --preset) preset=${2:?test.sh: --preset needs a name} && shift 2 ;;
  --preset=*) preset=${1#--preset=} && shift ;;
esac
rooms=()
while [[ ${1:-} =~ ^[a-z] ]]; do rooms+=("${1%/}") && shift; done

lists=(programs tests)
excluded=
case $preset in
  asan)
    excluded=lint
    ((${#rooms[@]})) || rooms=("${bytes_path[@]}")
    ;;
  tsan)
    excluded="lint|device"
    ((${#rooms[@]})) || rooms=("${audio_path[@]}")
    ;;
esac
if [[ -z $excluded ]] && { ((${#rooms[@]} == 0)) || [[ " ${rooms[*]} " == *" deploy"* ]]; }; then lists+=(lint); fi
# Generated code is compiled by the tests of proto, and the recipes by those of integration.
if [[ -z $excluded || $preset == asan ]] &&
  { ((${#rooms[@]} == 0)) || [[ " ${rooms[*]}" =~ " "(proto|integration) ]]; }; then
  lists+=(languages)
fi

# The targets tests_ROOM are made by carillon_needs in deploy/cmake/CarillonRoom.cmake.
targets=()
selection=()
# Packages are made and tried in a bare Debian or a container only when their test is named: that takes minutes, and
# the network.
if [[ " ${rooms[*]} " =~ " deploy/bare_"(packages|container|client)" " ]]; then
  lists+=(packages bare)
else
  excluded="${excluded:+$excluded|}packages"
fi
if [[ -n $excluded ]]; then selection+=(--label-exclude "$excluded"); fi
if ((${#rooms[@]})); then
  for room in "${rooms[@]}"; do
    folder=$room
    [[ -d $root/tests/$room ]] || folder=$(dirname "$room")
    # A test in C++ is a program of its own; one in Python needs what its folder does.
    if [[ -f $root/tests/$room.cc ]]; then targets+=("${room//\//_}"); else targets+=("tests_${folder//\//_}"); fi
  done
  selection+=(--tests-regex "^($(IFS='|' && printf '%s' "${rooms[*]}"))([/.]|\$)")
fi
# The sanitizers' fixed address map does not get on with much randomness in the kernel's.
launcher=()
bits=$(cat /proc/sys/vm/mmap_rnd_bits 2>/dev/null || echo 28)
if [[ $preset == ?san && $bits -gt 28 ]]; then
  if setarch --addr-no-randomize true 2>/dev/null; then
    launcher=(setarch --addr-no-randomize)
  else
    printf 'test.sh: %s cannot run here: the kernel places memory with %s random bits, of which it bears 28,\n' \
      "$preset" "$bits" >&2
    printf '  and setarch may not turn that off; as root, "sysctl vm.mmap_rnd_bits=28" lowers them\n' >&2
    exit 77
  fi
fi

"$root/deploy/setup.sh" "${lists[@]}"
"$root/deploy/build.sh" "$preset" -DCARILLON_TESTS=ON "${targets[@]}"

suppressions=$root/deploy/sanitizers
export ASAN_OPTIONS=${ASAN_OPTIONS-detect_stack_use_after_return=1}
export LSAN_OPTIONS=${LSAN_OPTIONS-suppressions=$suppressions/lsan.txt:print_suppressions=0}
export TSAN_OPTIONS=${TSAN_OPTIONS-suppressions=$suppressions/tsan.txt:halt_on_error=1}
export UBSAN_OPTIONS=${UBSAN_OPTIONS-print_stacktrace=1}

cd "$root"
exec "${launcher[@]}" /usr/bin/python3 -B deploy/run_tests.py "build/$preset" --preset "$preset" \
  --parallel "$(nproc)" "${selection[@]}" "$@"
