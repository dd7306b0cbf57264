// SPDX-License-Identifier: Apache-2.0
'use strict';

const fs = require('fs');
const net = require('net');
const os = require('os');
const path = require('path');

const SYSTEM_SOCKET = '/run/carillon/carillond.sock';

/**
 * Returns $CARILLON_SERVER; otherwise the socket of the user's own daemon, or, where there is none, that of the
 * machine's daemon.
 */
function defaultServer() {
  if (process.env.CARILLON_SERVER) return process.env.CARILLON_SERVER;
  const runtime = process.env.XDG_RUNTIME_DIR;
  const folder = runtime ? path.join(runtime, 'carillon') : `/tmp/carillon-${os.userInfo().uid}`;
  const own = path.join(folder, 'carillond.sock');
  return `unix:${!fs.existsSync(own) && fs.existsSync(SYSTEM_SOCKET) ? SYSTEM_SOCKET : own}`;
}

/** Whether nothing that is sent to the address leaves this machine: a Unix socket, or an address of loopback. */
function isLocal(server) {
  if (/^unix(-abstract)?:/.test(server)) return true;
  const host = server.replace(/^(dns|ipv4|ipv6):(\/\/[^/]*\/)?/, '').replace(/:[^:]*$/, '').replace(/^\[(.*)\]$/, '$1');
  return host === 'localhost' || host === '::1' || (net.isIPv4(host) && host.startsWith('127.'));
}

module.exports = { defaultServer, isLocal };
