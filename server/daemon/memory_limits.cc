// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/memory_limits.h"

#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <latch>
#include <new>
#include <system_error>
#include <thread>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

/// The daemon has 26 threads when it serves; gRPC begins some more of them under load.
constexpr size_t kThreadCount = 32;
/// Address space apart from stacks. A daemon that serves has 180 MiB, of which its program and
/// libraries, which are there already, take 100 MiB.
constexpr size_t kMemoryBytes = size_t{80} << 20U;

/// A daemon that serves on a Unix socket and the null device has 22 descriptors. Sound cards,
/// metrics, decompositions and connections need more.
constexpr rlim_t kDescriptorCount = 64;

absl::Status TooLittle(absl::string_view what) {
  return Refusal(absl::StatusCode::kResourceExhausted, "SERVER_OUT_OF_MEMORY",
                 absl::StrCat("the system gives the daemon too few ", what,
                              ": raise the limits of its memory and threads (ulimit -v, ulimit -u; "
                              "systemd's LimitAS=, LimitNPROC=, TasksMax=)"));
}

bool HasAddressSpace() {
  void* const memory = mmap(nullptr, kMemoryBytes, PROT_READ | PROT_WRITE,
                            MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) return false;
  munmap(memory, kMemoryBytes);
  return true;
}

/// Writes to stderr without memory of the heap.
void Say(absl::string_view text) {
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
}

/// Whether the process is stopping anyway.
std::atomic<bool> expects_end{false};

[[noreturn]] void EndWithoutMemory() {
  if (expects_end) {
    Say("warning: SERVER_OUT_OF_MEMORY: the stop is cut short, because no memory or threads are "
        "left; nothing that was acknowledged is lost\n");
    std::_Exit(EXIT_SUCCESS);
  }
  Say("error: SERVER_OUT_OF_MEMORY: the daemon has no memory or threads left, and ends: raise its "
      "limits (ulimit -v, ulimit -u; systemd's LimitAS=, MemoryMax=, TasksMax=)\n");
  std::_Exit(EXIT_FAILURE);
}

[[noreturn]] void EndOnException() {
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    EndWithoutMemory();
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again ||
        error.code() == std::errc::not_enough_memory) {
      EndWithoutMemory();
    }
    Say("error: the daemon ends on an error of the system: ");
    Say(error.what());
    Say("\n");
  } catch (const std::exception& error) {
    // The library of tasks within Embree throws this for want of a thread.
    if (absl::StartsWith(error.what(), "pthread_create has failed")) EndWithoutMemory();
    Say("error: the daemon ends on an exception: ");
    Say(error.what());
    Say("\n");
  } catch (...) {
    Say("error: the daemon ends on an exception of an unknown kind\n");
  }
  std::abort();
}

absl::Status CheckDescriptors() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur >= kDescriptorCount) {
    return absl::OkStatus();
  }
  if (limit.rlim_max >= kDescriptorCount) {
    limit.rlim_cur = kDescriptorCount;
    if (setrlimit(RLIMIT_NOFILE, &limit) == 0) return absl::OkStatus();
  }
  return Refusal(absl::StatusCode::kResourceExhausted, "TOO_FEW_DESCRIPTORS",
                 absl::StrCat("the daemon may open ", limit.rlim_max, " descriptors, and needs ",
                              kDescriptorCount,
                              ", and one more for each connection: raise the hard limit (ulimit "
                              "-Hn; systemd's LimitNOFILE=)"));
}

}  // namespace

absl::Status CheckLimits() {
  RETURN_IF_ERROR(CheckDescriptors());
  std::latch done(1);
  std::vector<std::thread> threads;
  threads.reserve(kThreadCount);
  const absl::Cleanup join = [&] {
    done.count_down();
    for (std::thread& thread : threads) thread.join();
  };
  try {
    while (threads.size() < kThreadCount) threads.emplace_back([&done] { done.wait(); });
  } catch (const std::system_error&) {
    return TooLittle(absl::StrCat("threads, ", threads.size(), " of ", kThreadCount,
                                  ", or too little address space for their stacks"));
  }
  return HasAddressSpace() ? absl::OkStatus() : TooLittle("bytes of address space");
}

void ExpectEnd() { expects_end = true; }

void ReportUncaughtExceptions() { std::set_terminate(EndOnException); }

}  // namespace carillon
