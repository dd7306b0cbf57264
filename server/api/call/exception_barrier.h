// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <new>
#include <system_error>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

inline absl::Status ServerOutOfMemory(absl::string_view what) {
  return Refusal(absl::StatusCode::kResourceExhausted, "SERVER_OUT_OF_MEMORY",
                 absl::StrCat("the daemon has not enough ", what,
                              " for this call; ask for less, or give the daemon more"));
}

inline absl::Status FailedWithin(const std::exception& error) {
  return Refusal(absl::StatusCode::kInternal, "INTERNAL",
                 absl::StrCat("the call failed within the daemon: ", error.what(),
                              "; report this as a defect of Carillon"));
}

/// Whether the system refused a thread, or memory for it.
inline bool LacksResources(const std::system_error& error) {
  return error.code() == std::errc::resource_unavailable_try_again ||
         error.code() == std::errc::not_enough_memory;
}

/// Calls `work()`, which returns an absl::Status or absl::StatusOr, and turns an exception into an
/// error, because a request that needs too much memory or too many threads must not end the
/// daemon.
template <typename Work>
auto WithoutExceptions(Work work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return ServerOutOfMemory("memory");
  } catch (const std::system_error& error) {
    if (LacksResources(error)) return ServerOutOfMemory("memory or threads");
    return FailedWithin(error);
  } catch (const std::exception& error) {
    return FailedWithin(error);
  }
}

}  // namespace carillon
