// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/strings/string_view.h"

namespace carillon {

/// Returns the full name of a call, such as "/carillon.v1.AudioService/Listen", from the name of
/// the function that serves it, "Listen" or, for calls that RawService takes, "ListenRaw". Returns
/// an unknown name unchanged. No two services of the daemon have a call of the same name.
std::string CallName(absl::string_view function);

}  // namespace carillon
