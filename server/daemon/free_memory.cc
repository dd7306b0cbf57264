// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/free_memory.h"

#include <malloc.h>
#include <sys/auxv.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <thread>

namespace carillon {
namespace {

/// Larger blocks have pages of their own, which go back as soon as the block is freed.
constexpr int kOwnPagesBytes = 256 << 10;
/// Free memory that stays at the end of an arena.
constexpr int kKeptBytes = 1 << 20;
constexpr char kTunables[] = "GLIBC_TUNABLES";
constexpr char kThreadCache[] = "glibc.malloc.tcache_count";

/// Executes the program of this process once more, with the thread caches off. The function returns
/// if GLIBC_TUNABLES has a size for them already, or if the program cannot be executed.
void RestartWithoutThreadCaches(char* const* argv) {
  // The loader hides the variable from a program with privileges of its file, at each start anew.
  if (getauxval(AT_SECURE) != 0) return;
  // If the loader was started with this program as its argument, /proc/self/exe is the loader.
  if (getauxval(AT_BASE) == 0) return;
  const char* const given = std::getenv(kTunables);
  std::string tunables = given == nullptr ? "" : given;
  if (tunables.find(kThreadCache) != std::string::npos) return;
  if (!tunables.empty()) tunables += ':';
  tunables.append(kThreadCache).append("=0");
  setenv(kTunables, tunables.c_str(), 1);
  std::error_code error;
  // The system names a process by the last part of this path, which is "exe" in /proc/self/exe.
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) execv(program.c_str(), argv);
}

}  // namespace

void BoundFreeMemory(char* const* argv) {
  RestartWithoutThreadCaches(argv);
  mallopt(M_MMAP_THRESHOLD, kOwnPagesBytes);
  mallopt(M_TRIM_THRESHOLD, kKeptBytes);
  mallopt(M_ARENA_MAX, static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
}

void ReturnFreeMemory() { malloc_trim(kKeptBytes); }

}  // namespace carillon
