// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

/// Calls `work()`, which returns an absl::Status or absl::StatusOr, and turns an exception into an
/// error, because a request that needs too much memory must not end the daemon.
template <typename Work>
auto WithoutExceptions(Work work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return Refusal(absl::StatusCode::kResourceExhausted, "SERVER_OUT_OF_MEMORY",
                   "the daemon has not enough memory for this call; ask for less, or give the "
                   "daemon more memory");
  } catch (const std::exception& error) {
    return Refusal(absl::StatusCode::kInternal, "INTERNAL",
                   absl::StrCat("the call failed within the daemon: ", error.what(),
                                "; report this as a defect of Carillon"));
  }
}

}  // namespace carillon
