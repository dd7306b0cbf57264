// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace carillon {

/// Where the daemon listens and clients look when nobody says: $CARILLON_SERVER, or
/// "unix:$XDG_RUNTIME_DIR/carillon/carillond.sock", or "unix:/tmp/carillon-UID/carillond.sock".
/// An address is "unix:PATH" or "HOST:PORT".
std::string DefaultServerAddress();

}  // namespace carillon
