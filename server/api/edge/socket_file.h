// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

namespace carillon {

/// The file of a Unix socket that this process has bound. The system does not give its inode to
/// another file while the socket is open.
class SocketFile {
 public:
  /// Remembers the file at `path`, to which a socket was just bound. Returns nothing, and leaves
  /// the reason in errno, if the file cannot be seen.
  static std::optional<SocketFile> Remember(const std::string& path);

  /// Removes the file, unless somebody has put another one in its place.
  void Remove() const;

 private:
  SocketFile(std::string path, dev_t device, ino_t inode);

  std::string path_;
  dev_t device_;
  ino_t inode_;
};

}  // namespace carillon
