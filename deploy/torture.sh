#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/torture.sh [NAME...] [--minutes N]: builds, and attacks the programs at length: all of tests/torture, or its
# tests of those names, such as device_life. It prints what it measures; the times have limits here,
# so nothing else may run on the machine. --minutes says how long the test churn lasts, 10 by default.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
# shellcheck source=deploy/environment.sh
source "$root/deploy/environment.sh"

"$root/deploy/setup.sh" programs tests
"$root/deploy/build.sh" release -DCARILLON_TESTS=ON tests_torture
names=()
while (($#)); do
  case $1 in
    --minutes) export CARILLON_TORTURE_MINUTES=${2:?--minutes needs a number} && shift 2 ;;
    *) names+=("$1") && shift ;;
  esac
done
pattern=${names[*]:-.*}
export CARILLON_TORTURE=long
exec ctest --test-dir "$root/build/release" --tests-regex "^torture/test_(${pattern// /|})\$" --timeout 7200 \
  --output-on-failure --verbose
