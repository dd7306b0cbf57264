// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/confine_writes.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>

namespace carillon::precompute {
namespace {

constexpr uint64_t kWrites = LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_REMOVE_DIR |
                             LANDLOCK_ACCESS_FS_REMOVE_FILE | LANDLOCK_ACCESS_FS_MAKE_CHAR |
                             LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
                             LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO |
                             LANDLOCK_ACCESS_FS_MAKE_BLOCK | LANDLOCK_ACCESS_FS_MAKE_SYM;

void Allow(int rules, const char* path, uint64_t access) {
  const int place = open(path, O_PATH | O_CLOEXEC);
  if (place < 0) return;
  const landlock_path_beneath_attr beneath{.allowed_access = access, .parent_fd = place};
  syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &beneath, 0);
  close(place);
}

}  // namespace

void ConfineWrites(std::span<const std::string> files) {
  landlock_ruleset_attr handled{};
  handled.handled_access_fs = kWrites;
  const auto rules =
      static_cast<int>(syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0));
  if (rules < 0) return;
  for (const std::string& file : files) {
    const std::string folder = std::filesystem::path(file).parent_path().string();
    Allow(rules, folder.empty() ? "." : folder.c_str(), kWrites);
  }
  Allow(rules, "/dev/null", LANDLOCK_ACCESS_FS_WRITE_FILE);
  // The kernel requires this, so that a program with more privileges cannot be misled.
  prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  syscall(SYS_landlock_restrict_self, rules, 0);
  close(rules);
}

}  // namespace carillon::precompute
