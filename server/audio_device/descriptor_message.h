// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace carillon {

/// Sends one byte and a copy of a descriptor through a Unix socket. False: nobody reads it.
bool SendDescriptor(int socket, int descriptor);

/// Waits for one byte and a descriptor from a Unix socket. Absent: the other end is closed, or it
/// sent something else.
std::optional<int> ReceiveDescriptor(int socket);

}  // namespace carillon
