// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "carillon/worker/v1/worker.pb.h"

namespace carillon {

/// Splits the bytes of a worker's event pipe into events (protobuf's delimited form). A worker
/// reads untrusted files and may write any bytes, so the reader buffers at most one event.
class WorkerEventReader {
 public:
  static constexpr uint32_t kMaxEventBytes = 64 << 10;

  /// Calls `on_event` for each event that `bytes` completes.
  /// Errors: DataLoss (WORKER_CRASHED). The reader cannot be used after an error.
  absl::Status Feed(std::string_view bytes,
                    absl::FunctionRef<void(const worker::v1::WorkerEvent&)> on_event);

 private:
  std::string pending_;
};

}  // namespace carillon
