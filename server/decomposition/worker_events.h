// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon {

/// Cuts the bytes of a worker's event pipe into events (protobuf's delimited form). A worker chews
/// strangers' data and may write anything: nothing here grows beyond one event.
class WorkerEventReader {
 public:
  static constexpr uint32_t kMaxEventBytes = 64 << 10;

  /// Calls `on_event` for each event that `bytes` completes.
  /// Errors: DataLoss (WORKER_GARBAGE). After an error the reader is of no further use.
  absl::Status Feed(std::string_view bytes,
                    absl::FunctionRef<void(const v1::WorkerEvent&)> on_event);

 private:
  std::string pending_;
};

/// An event as the pipe has it.
std::string Delimited(const v1::WorkerEvent& event);

}  // namespace carillon
