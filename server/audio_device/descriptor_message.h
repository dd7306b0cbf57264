// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace carillon {

/// Sends one byte and a copy of a descriptor through a Unix socket. Returns false if the other end
/// is closed.
bool SendDescriptor(int socket, int descriptor);

/// Waits for one byte and a descriptor from a Unix socket. Returns nothing if the other end is
/// closed or sent something else.
std::optional<int> ReceiveDescriptor(int socket);

}  // namespace carillon
