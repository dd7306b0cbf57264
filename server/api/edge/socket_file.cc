// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/socket_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <utility>

namespace carillon {

std::optional<SocketFile> SocketFile::Remember(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return std::nullopt;
  return SocketFile(path, status.st_dev, status.st_ino);
}

SocketFile::SocketFile(std::string path, dev_t device, ino_t inode)
    : path_(std::move(path)), device_(device), inode_(inode) {}

void SocketFile::Remove() const {
  struct stat now {};
  if (lstat(path_.c_str(), &now) != 0 || now.st_dev != device_ || now.st_ino != inode_) return;
  unlink(path_.c_str());
}

}  // namespace carillon
