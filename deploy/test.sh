#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/test.sh [--preset release|dev|asan|tsan] [ARGUMENTS OF ctest...]
#
# Installs what is missing, builds, and runs the tests: all of them, lint too; under asan all but
# lint, with more time; under tsan those of the audio path, without the sound server, which was compiled
# without the sanitizer.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"

# The rooms whose threads meet the audio thread.
audio_path='server_(base|excitation|synthesis|scene|audio_device)'

preset=release
case ${1:-} in
  --preset) preset=${2:?test.sh: --preset needs a name} && shift 2 ;;
  --preset=*) preset=${1#--preset=} && shift ;;
esac

targets=()
selection=()
case $preset in
  asan) selection=(--label-exclude lint) ;;
  tsan)
    selection=(--label-exclude "lint|device" --tests-regex "^${audio_path//_/\/}/")
    "$root/deploy/build.sh" "$preset" carillon_messages
    mapfile -t targets < <(cmake --build --preset "$preset" --target help |
      sed -nE "s/^(${audio_path}_[a-z0-9_]*): phony$/\1/p")
    ;;
esac
"$root/deploy/build.sh" "$preset" "${targets[@]}"

suppressions=$root/deploy/sanitizers
export ASAN_OPTIONS=${ASAN_OPTIONS-detect_stack_use_after_return=1}
export LSAN_OPTIONS=${LSAN_OPTIONS-suppressions=$suppressions/lsan.txt:print_suppressions=0}
export TSAN_OPTIONS=${TSAN_OPTIONS-suppressions=$suppressions/tsan.txt:halt_on_error=1}
export UBSAN_OPTIONS=${UBSAN_OPTIONS-print_stacktrace=1}

# The sanitizers' fixed address map does not get on with much randomness in the kernel's.
launcher=()
bits=$(cat /proc/sys/vm/mmap_rnd_bits 2>/dev/null || echo 28)
if [[ $preset == ?san && $bits -gt 28 ]] && setarch --addr-no-randomize true 2>/dev/null; then
  launcher=(setarch --addr-no-randomize)
fi

cd "$root"
exec "${launcher[@]}" ctest --preset "$preset" --parallel "$(nproc)" "${selection[@]}" "$@"
