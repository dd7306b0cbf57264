// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace carillon {

/// Where the daemon listens if it is given no address: $CARILLON_SERVER, or
/// "unix:$XDG_RUNTIME_DIR/carillon/carillond.sock", or "unix:/tmp/carillon-UID/carillond.sock".
/// An address is "unix:PATH" or "HOST:PORT".
std::string DefaultServerAddress();

/// Where a client looks if it is given no address: DefaultServerAddress(), or, if there is no
/// socket, that of the daemon that systemd runs, "unix:/run/carillon/carillond.sock", if there is
/// one.
std::string ReachableServerAddress();

/// Whether nobody beyond this machine can read what is sent to the address.
bool IsOnThisMachine(const std::string& address);

}  // namespace carillon
