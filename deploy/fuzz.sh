#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/fuzz.sh [SECONDS] [NAME...]: builds the fuzzers of tests/fuzz with clang, and runs each, or those of the names
# given (npz, mesh_ply), for so many seconds, 60 by default. What a run finds new lies in build/fuzz/corpora/NAME, from
# which the next run goes on; what stopped a fuzzer in build/fuzz/found, from where it goes into tests/fuzz/corpora/NAME
# with the mended reader.
# Prints the executions of each, and fails if any fuzzer crashed, leaked, took over 1 GiB or 20 s for one input.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"
seconds=60
if [[ ${1:-} =~ ^[0-9]+$ ]]; then seconds=$1 && shift; fi
names=("$@")
if ((${#names[@]} == 0)); then
  for folder in "$root"/tests/fuzz/corpora/*/; do names+=("$(basename "$folder")"); done
fi

"$root/deploy/setup.sh" programs fuzz
"$root/deploy/build.sh" fuzz "${names[@]/#/fuzz_}"

build=$root/build/fuzz
mkdir -p "$build/found"
export ASAN_OPTIONS=${ASAN_OPTIONS-detect_stack_use_after_return=1:allocator_may_return_null=0}
export LSAN_OPTIONS=${LSAN_OPTIONS-suppressions=$root/deploy/sanitizers/lsan.txt:print_suppressions=0}
failed=()
for name in "${names[@]}"; do
  mkdir -p "$build/corpora/$name"
  log=$build/found/$name.log
  if "$build/bin/fuzz_$name" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=1024 -max_len=16384 \
    -close_fd_mask=1 -print_final_stats=1 -artifact_prefix="$build/found/$name-" \
    "$build/corpora/$name" "$root/tests/fuzz/corpora/$name" >"$log" 2>&1; then
    printf '%s: %s executions\n' "$name" "$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")"
  else
    failed+=("$name")
    printf '%s: FAILED, see %s\n' "$name" "$log"
    grep -E '^(SUMMARY|==[0-9]+== ERROR|.*runtime error)' "$log" || true
  fi
done
((${#failed[@]} == 0))
