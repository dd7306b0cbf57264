// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon::cli {

/// Returns the names of the contact traces (*.contacts) in `folder` without their suffix, in order.
/// Errors: NotFound (FILE_NOT_FOUND).
absl::StatusOr<std::vector<std::string>> ListTraces(const std::filesystem::path& folder);

/// A file descriptor that holds a lock until it is destroyed or its process ends.
class FileLock {
 public:
  FileLock() = default;
  FileLock(FileLock&& other) noexcept;
  FileLock& operator=(FileLock&& other) noexcept;
  ~FileLock();

  /// Opens or creates the file and locks it. If another process has the lock, waits for it if
  /// `waits` is true. Returns a lock that holds nothing if the file cannot be opened, or if another
  /// process has the lock.
  static FileLock Take(const std::filesystem::path& path, bool waits);

  bool holds() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

/// The folder into which clips are rendered:
///
///     NAME.wav  NAME.stems/HANDLE.wav    the sound, and that of each object alone
///     NAME.json                          its record, a line of the manifest; written last
///     manifest.jsonl                     the records of all clips
///     .lock                              held for the moments in which a process looks for what
///                                        others left behind, or writes the manifest
///     .work-XXXXXX/                      what a process has not finished; it holds a lock inside
///
/// Files appear under their names at once and whole. Several processes, also on several machines
/// that share the folder, may work at the same time.
class ClipFolder {
 public:
  /// Creates the folder if needed, and removes the unfinished files of processes that have ended.
  /// Errors: Internal (OUTPUT_NOT_WRITABLE).
  static absl::StatusOr<ClipFolder> Open(const std::filesystem::path& path);
  ClipFolder(ClipFolder&&) noexcept = default;
  ClipFolder& operator=(ClipFolder&&) = delete;
  /// Removes the files that were not published.
  ~ClipFolder();

  std::filesystem::path Final(const std::string& file) const { return path_ / file; }
  /// Returns the path of a file that is not finished. `name` may contain a folder, which is
  /// created.
  std::filesystem::path Work(const std::string& file) const;

  /// Moves a finished file, or a folder of them, to its place. Errors: Internal
  /// (OUTPUT_NOT_WRITABLE).
  absl::Status Publish(const std::string& file) const;

  /// Writes a file at once and whole. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status Write(const std::string& file, const std::string& text) const;

  /// Writes the manifest: the records of `clips`, in their order, without the clips that have no
  /// record. Errors: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status WriteManifest(std::span<const std::string> clips) const;

 private:
  ClipFolder(std::filesystem::path path, std::filesystem::path work, FileLock lock);

  std::filesystem::path path_, work_;
  FileLock lock_;
};

}  // namespace carillon::cli
