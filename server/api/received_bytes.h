// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

namespace carillon {

/// Returns how many bytes have come over a TCP socket since it was connected. Returns nothing for
/// another descriptor, such as a Unix socket, of which the system does not count them.
std::optional<uint64_t> ReceivedBytes(int descriptor);

}  // namespace carillon
