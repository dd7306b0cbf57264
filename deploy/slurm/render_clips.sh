#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# sbatch --array=1-N deploy/slurm/render_clips.sh TRACES CLIPS DATABASE [OPTIONS OF carillon render...]
#
# One task of an array that renders the folder TRACES into the folder CLIPS (docs/clips.md), each task its share. It
# starts a daemon of its own on a copy of DATABASE, a file that `carillon db backup` has written, with the programs of
# $CARILLON_BIN or of the PATH. All three are on a file system that the nodes share.
#SBATCH --requeue
set -euo pipefail
traces=${1:?a folder of traces}
clips=${2:?a folder for the clips}
database=${3:?a database}
shift 3
if [[ -n ${CARILLON_BIN:-} ]]; then PATH=$CARILLON_BIN:$PATH; fi

folder=$(mktemp -d "${TMPDIR:-/tmp}/carillon-clips.XXXXXX")
daemon=
stop() {
  if [[ -n $daemon ]]; then
    kill "$daemon" 2>/dev/null || true
    wait "$daemon" || true
  fi
  rm -rf "$folder"
}
trap stop EXIT
mkdir "$folder/data"
chmod 700 "$folder/data"
cp "$database" "$folder/data/carillon.db"
export CARILLON_SERVER=unix:$folder/socket
carillond --data-dir "$folder/data" --listen "$CARILLON_SERVER" --audio-device null --no-transfers \
  >"$folder/address" 2>"$folder/log" &
daemon=$!
for _ in {1..300}; do
  if carillon status >/dev/null 2>&1; then break; fi
  if ! kill -0 "$daemon" 2>/dev/null; then
    tail -n 5 "$folder/log" >&2
    exit 1
  fi
  sleep 0.1
done
carillon render "$traces" --out "$clips" --shard "${SLURM_ARRAY_TASK_ID:-1}/${SLURM_ARRAY_TASK_COUNT:-1}" "$@"
