// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "server/daemon/options.h"

namespace carillon {

/// Returns InvalidArgument (INVALID_CONFIGURATION).
absl::Status InvalidConfiguration(absl::string_view message);

/// Returns the same refusal with `place`, which is a line of the configuration file, before its
/// message.
absl::Status AtPlace(const absl::Status& status, absl::string_view place);

/// Checks one setting that is a number. `key` is the setting's key in the configuration file, and
/// `name` is how the user wrote it, as a key or as a flag. Errors: InvalidArgument
/// (INVALID_CONFIGURATION).
absl::Status CheckNumber(absl::string_view key, absl::string_view name, double value);

/// Checks one setting that is a text. Errors: those of CheckNumber.
absl::Status CheckText(absl::string_view key, absl::string_view name, absl::string_view value);

/// Checks that no flag of the command line ends in "=", because it would take the next flag for its
/// value. Errors: those of CheckNumber.
absl::Status CheckValues(int argc, const char* const* argv);

/// Checks that a path can be that of a configuration file. Errors: those of CheckNumber.
absl::Status CheckIsFile(const std::string& path);

/// Checks which settings are given together. Errors: those of CheckNumber.
absl::Status CheckTogether(const Options& options);

}  // namespace carillon
