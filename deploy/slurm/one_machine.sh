#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/slurm/one_machine.sh start FOLDER [NODES]
# deploy/slurm/one_machine.sh stop|slurmctld|slurmd FOLDER
#
# A Slurm cluster on this machine alone, in FOLDER, on ports of its own and beside any other: for the tests, and to try
# the daemon's --slurm-dir. It has one node, or NODES, node1 and so on, each with all cores and all memory. Needs
# Debian's slurm-wlm and munge, and root, as slurmd does. `slurmctld` starts the controller again and `slurmd` node1,
# after a crash for instance. The commands of Slurm find the cluster by
#
#   export SLURM_CONF=FOLDER/slurm.conf
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
action=${1:?start, stop, slurmctld or slurmd}
folder=$(realpath "${2:?a folder}")
nodes=${3:-1}
export SLURM_CONF=$folder/slurm.conf

free_port() {
  /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

configure() {
  mkdir -p "$folder"/{state,spool,log}
  chmod 755 "$folder"
  dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 status=none
  chmod 400 "$folder/munge.key"
  local memory_mib host
  host=$(hostname -s)
  memory_mib=$(awk '/MemTotal/ {print int($2 / 1024)}' /proc/meminfo)
  {
    sed -e "s|@FOLDER@|$folder|g" -e "s|@HOST@|$host|g" -e "s|@CONTROLLER_PORT@|$(free_port)|g" "$here/slurm.conf.in"
    for ((node = 1; node <= nodes; ++node)); do
      echo "NodeName=node$node NodeHostname=$host NodeAddr=127.0.0.1 Port=$(free_port) CPUs=$(nproc)" \
        "RealMemory=$memory_mib State=UNKNOWN"
    done
  } >"$folder/slurm.conf"
}

start_munged() {
  # --force: the folder's rights are the caller's business.
  munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
    --pid-file="$folder/munged.pid" --log-file="$folder/log/munged.log" --seed-file="$folder/munge.seed"
}

stop_by() {
  local pid
  pid=$(cat "$1" 2>/dev/null) || return 0
  kill "$pid" 2>/dev/null || return 0
  while kill -0 "$pid" 2>/dev/null; do read -rt 0.05 <> <(:) || :; done
}

case $action in
  start)
    configure
    start_munged
    slurmctld
    for ((node = 1; node <= nodes; ++node)); do slurmd -N "node$node"; done
    ;;
  stop)
    scancel --user="$(id -un)" 2>/dev/null || :
    for pid_file in "$folder"/slurmd-*.pid "$folder"/{slurmctld,munged}.pid; do stop_by "$pid_file"; done
    ;;
  slurmctld) slurmctld ;;
  slurmd) slurmd -N node1 ;;
  *)
    echo "$0: there is no action \"$action\"" >&2
    exit 2
    ;;
esac
