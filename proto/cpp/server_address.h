// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace carillon {

/// Returns the address of a daemon that is given no address. It is $CARILLON_SERVER, or
/// "unix:$XDG_RUNTIME_DIR/carillon/carillond.sock", or "unix:/tmp/carillon-UID/carillond.sock". An
/// address is "unix:PATH" or "HOST:PORT".
std::string DefaultServerAddress();

/// Returns the address for a client that is given no address. It is DefaultServerAddress(), unless
/// that has no socket and the daemon of systemd has one, "unix:/run/carillon/carillond.sock".
std::string ReachableServerAddress();

/// Returns true if the text is "unix:PATH" or ends with a port, as in "HOST:PORT".
bool IsServerAddress(const std::string& text);

/// Returns true if no other machine can read data that is sent to the address.
bool IsOnThisMachine(const std::string& address);

}  // namespace carillon
