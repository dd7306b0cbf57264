// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/work_folder.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

namespace fs = std::filesystem;

/// A task writes a mesh, a request and a model. Less space is enough for none of them.
constexpr uintmax_t kLeastBytes = 256 << 10;

absl::string_view WhatToDo(const std::error_code& error) {
  if (error == std::errc::no_space_on_device) return "free some space on its disk";
  if (error == std::errc::not_a_directory || error == std::errc::file_exists) {
    return "remove the file in place of the folder, which the daemon then makes anew";
  }
  return "see that the daemon's user may write there";
}

}  // namespace

absl::Status UnusableWorkFolder(const fs::path& path, const std::error_code& error) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "WORK_FOLDER_UNUSABLE",
                 absl::StrCat(path.string(), ", which a decomposition needs, cannot be made (",
                              error.message(), "): ", WhatToDo(error)));
}

absl::Status PrepareWorkFolder(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (!error) fs::create_directories(folder, error);
  if (!error) fs::permissions(folder, fs::perms::owner_all, error);
  return error ? UnusableWorkFolder(folder, error) : absl::OkStatus();
}

absl::Status CheckWorkFolder(const fs::path& folder) {
  std::error_code ignored;
  const bool is_missing = !fs::exists(fs::symlink_status(folder, ignored));
  const fs::path there = is_missing ? folder.parent_path() : folder;
  if (!fs::is_directory(there, ignored)) {
    return UnusableWorkFolder(folder, std::make_error_code(std::errc::not_a_directory));
  }
  if (faccessat(AT_FDCWD, there.c_str(), W_OK | X_OK, AT_EACCESS) != 0) {
    return UnusableWorkFolder(folder, std::error_code(errno, std::generic_category()));
  }
  std::error_code error;
  const fs::space_info space = fs::space(there, error);
  if (error || space.available >= kLeastBytes) return absl::OkStatus();
  return UnusableWorkFolder(folder, std::make_error_code(std::errc::no_space_on_device));
}

}  // namespace carillon
