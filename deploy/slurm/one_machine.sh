#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# deploy/slurm/one_machine.sh start|stop FOLDER
# deploy/slurm/one_machine.sh slurmctld|slurmd FOLDER
#
# A Slurm cluster of this machine alone, in FOLDER, on ports of its own and beside any other: for the test, and to
# try the daemon's --executor slurm. Needs Debian's slurm-wlm and munge, and root, as slurmd does. `slurmctld` and
# `slurmd` start that one again, after a crash for instance. The commands of Slurm find the cluster by
#
#   export SLURM_CONF=FOLDER/slurm.conf
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
action=${1:?start, stop, slurmctld or slurmd}
folder=$(realpath "${2:?a folder}")
export SLURM_CONF=$folder/slurm.conf

free_port() {
  /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

configure() {
  mkdir -p "$folder"/{state,spool,log}
  chmod 755 "$folder"
  dd if=/dev/urandom of="$folder/munge.key" bs=128 count=1 status=none
  chmod 400 "$folder/munge.key"
  local memory_mib
  memory_mib=$(awk '/MemTotal/ {print int($2 / 1024)}' /proc/meminfo)
  sed -e "s|@FOLDER@|$folder|g" -e "s|@HOST@|$(hostname -s)|g" -e "s|@CPUS@|$(nproc)|g" \
    -e "s|@MEMORY_MIB@|$memory_mib|g" -e "s|@CONTROLLER_PORT@|$(free_port)|g" \
    -e "s|@NODE_PORT@|$(free_port)|g" "$here/slurm.conf.in" >"$folder/slurm.conf"
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
    slurmd
    ;;
  stop)
    scancel --user="$(id -un)" 2>/dev/null || :
    for pid_file in slurmd slurmctld munged; do stop_by "$folder/$pid_file.pid"; done
    ;;
  slurmctld | slurmd) "$action" ;;
  *)
    echo "$0: there is no action \"$action\"" >&2
    exit 2
    ;;
esac
