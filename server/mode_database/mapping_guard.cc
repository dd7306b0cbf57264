// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/mapping_guard.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>

#include "absl/base/thread_annotations.h"
#include "server/base/mutex.h"

namespace carillon {
namespace {

/// A guarded mapping. The signal handler reads it without a lock.
struct Mapping {
  std::atomic<char*> begin{nullptr};
  std::atomic<size_t> byte_count{0};
  std::atomic<std::atomic<bool>*> truncated{nullptr};  ///< null if the entry is free
};
std::array<Mapping, 256> mappings;
static_assert(std::atomic<std::atomic<bool>*>::is_always_lock_free);

Mutex mappings_mutex;
bool handles_signal ABSL_GUARDED_BY(mappings_mutex) = false;

/// Puts a page of zeros at an address of a guarded mapping. Returns false for other addresses.
bool PutPage(char* address) {
  for (const Mapping& mapping : mappings) {
    std::atomic<bool>* const truncated = mapping.truncated.load();
    char* const begin = mapping.begin;
    if (truncated == nullptr || address < begin || address >= begin + mapping.byte_count) continue;
    truncated->store(true);
    const auto page_bytes = static_cast<uintptr_t>(sysconf(_SC_PAGESIZE));
    char* const page = address - reinterpret_cast<uintptr_t>(address) % page_bytes;
    return mmap(page, page_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED,
                -1, 0) == page;
  }
  return false;
}

extern "C" void HandleBusError(int signal_number, siginfo_t* info, void* /*context*/) {
  const int saved_errno = errno;
  // Without a handler the access, made again, ends the process.
  if (!PutPage(static_cast<char*>(info->si_addr))) signal(signal_number, SIG_DFL);
  errno = saved_errno;
}

void HandleSignal() {
  struct sigaction action {};
  action.sa_sigaction = HandleBusError;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGBUS, &action, nullptr);
}

}  // namespace

void MappingGuard::Guard(volatile void* begin, size_t byte_count) {
  auto* const address = static_cast<char*>(const_cast<void*>(begin));
  const MutexLock lock(&mappings_mutex);
  if (!handles_signal) HandleSignal();
  handles_signal = true;
  Mapping* free = nullptr;
  for (Mapping& mapping : mappings) {
    std::atomic<bool>* const truncated = mapping.truncated.load();
    if (truncated == &was_truncated_ && mapping.begin == address) return;
    if (truncated == nullptr) free = &mapping;
  }
  if (free == nullptr) return;
  free->begin = address;
  free->byte_count = byte_count;
  free->truncated = &was_truncated_;
}

void MappingGuard::Release() {
  const MutexLock lock(&mappings_mutex);
  for (Mapping& mapping : mappings) {
    if (mapping.truncated.load() == &was_truncated_) mapping.truncated = nullptr;
  }
}

}  // namespace carillon
