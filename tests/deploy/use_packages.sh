#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Runs as root in a bare Debian that nothing else uses, in a folder with the packages of the version before in before/
# and those of this one in now/: installs, uses, upgrades, removes and purges them, and fails where one does not work.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8
export CARILLON_SERVER=unix:/run/carillon/carillond.sock
settings=/etc/carillon/carillond.toml
packages=(carillond carillon-precompute carillon carillon-console libcarillon-dev node-carillon python3-carillon)
daemon=

fail() {
  printf 'use_packages: %s\n' "$*" >&2
  if [[ -e daemon.log ]]; then cat daemon.log >&2; fi
  exit 1
}

run_apt() { apt-get -q -y -o Dpkg::Use-Pty=0 -o Acquire::Retries=3 "$@" >apt.log 2>&1 || fail "$(cat apt.log)"; }

install_packages() { run_apt install --no-install-recommends "$@"; }

# By the line that deploy/package.sh prints. Blender itself is left out, because it is large.
install_from_repository() {
  echo "deb [trusted=yes] file:$PWD/$1 ./" >/etc/apt/sources.list.d/carillon.list
  run_apt update
  install_packages "${packages[@]}"
  run_apt install --simulate blender-carillon
}

setting() { sed -n "s/^$1=//p" /lib/systemd/system/carillond.service; }

# The tree has no systemd that runs, so this does what the unit says.
start_daemon() {
  install -d -o carillon -g carillon -m "$(setting StateDirectoryMode)" "/var/lib/$(setting StateDirectory)"
  install -d -o carillon -g carillon -m "$(setting RuntimeDirectoryMode)" "/run/$(setting RuntimeDirectory)"
  local -a words
  rm -f daemon.out
  read -ra words <<<"$(setting ExecStart)"
  setpriv --reuid="$(setting User)" --regid="$(setting User)" --init-groups --no-new-privs \
    env -i STATE_DIRECTORY=/var/lib/carillon RUNTIME_DIRECTORY=/run/carillon CONFIGURATION_DIRECTORY=/etc/carillon \
    "${words[@]}" >daemon.out 2>>daemon.log &
  daemon=$!
  for _ in {1..100}; do
    if grep -qs '^listening on ' daemon.out; then return; fi
    sleep 0.1
  done
  fail "carillond does not start"
}

stop_daemon() {
  kill "$daemon"
  wait "$daemon" || fail "carillond ended with $?"
}

hear_a_strike() {
  carillon listen --seconds 2 --out heard.wav &
  local listener=$!
  sleep 0.5
  carillon strike bar --point 0.1,0.015,0.008 --impulse 0,0,-0.01 --duration 0.0001 --seconds 1
  wait "$listener"
  # A second of silence in 24 bits is nothing but zeros; a bronze bar rings for longer.
  (($(tail -c +100 heard.wav | tr -d '\0' | wc -c) > 50000)) || fail "the strike is not in heard.wav"
}

install_from_repository before
getent passwd carillon >/dev/null || fail "there is no user carillon"
start_daemon
carillon example bar
carillon model create bar.obj --material bell_bronze --wait
stop_daemon

# A setting of the administrator survives the upgrade, and so do the models.
echo 'sample_rate = 44100' >>"$settings"
install_from_repository now
[[ $(dpkg-query -W -f '${Version}' carillond) == "$(cd now && echo carillond_*.deb | cut -d _ -f 2)" ]] ||
  fail "the upgrade left the version before"
grep -q '^sample_rate = 44100$' "$settings" || fail "the upgrade replaced $settings"
start_daemon
carillon status | grep -q 44100 || fail "carillond does not read $settings"
[[ $(carillon model list | wc -l) == 1 ]] || fail "the upgrade lost the model"
hear_a_strike
carillon model create bar.obj --label again --material bell_bronze --accuracy 5% --wait
stop_daemon

# Each page of ten minutes is typed as printed, in a folder of its own.
start_daemon
install_packages python3
for page in ten_minutes_{python,cpp,c,node,any_language}.md; do
  mkdir -p "pages/$page"
  (cd "pages/$page" && env -u CARILLON_SERVER ../../type_page.py "/usr/share/doc/carillon/docs/$page" ../../now) ||
    fail "$page does not work as printed"
done
wheel=$(echo "$PWD"/now/carillon-*-py3-none-any.whl)
PYTHONPATH=$wheel python3 -c "
import carillon
assert carillon.__file__.startswith('$wheel'), carillon.__file__
with carillon.connect() as c:
    assert c.model('again').render_strike((0.1, 0.015, 0.008), (0, 0, -0.01)).peak > 1e-4" ||
  fail "the wheel is not whole"
stop_daemon

for document in carillon-precompute/{copyright,SOURCE} carillond/copyright carillon/README.md; do
  [[ -s /usr/share/doc/$document ]] || fail "/usr/share/doc/$document is missing"
done
grep -q 'AFFERO' /usr/share/doc/carillon-precompute/copyright || fail "the AGPL is missing"

run_apt remove "${packages[@]}"
[[ ! -e /usr/bin/carillond && ! -e /lib/systemd/system/carillond.service ]] || fail "remove left programs"
[[ -e $settings && -e /var/lib/carillon/carillon.db ]] || fail "remove deleted settings or models"
# A package without settings is gone when it is removed, and apt knows its name no more.
run_apt purge carillond
[[ ! -e /etc/carillon && ! -e /var/lib/carillon ]] || fail "purge left settings or models"
known=$(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "${packages[@]}" 2>/dev/null |
  grep -v ' not-installed$') || true
[[ -z $known ]] || fail "purge left $known"
printf 'use_packages: installed, upgraded, heard, removed and purged\n'
