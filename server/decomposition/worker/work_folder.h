// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon {

/// Makes the folder for the files of running tasks empty, and usable by this user only. Errors:
/// FailedPrecondition (WORK_FOLDER_UNUSABLE).
absl::Status PrepareWorkFolder(const std::filesystem::path& folder);

/// Checks that tasks can make their files in the folder, or that the folder is missing and can be
/// made anew. Changes nothing. Errors: those of PrepareWorkFolder.
absl::Status CheckWorkFolder(const std::filesystem::path& folder);

/// Returns the error for a file or folder of a task that cannot be made, WORK_FOLDER_UNUSABLE.
absl::Status UnusableWorkFolder(const std::filesystem::path& path, const std::error_code& error);

}  // namespace carillon
