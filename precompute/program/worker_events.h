// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/status.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// Sends the progress and the error of the work to the process that started this one, as delimited
/// WorkerEvent messages (proto/carillon/worker/v1/worker.proto) on an open descriptor. Only one
/// thread may send at a time. It is no error if the reader has gone away, because the result may
/// still be wanted.
class WorkerEvents {
 public:
  /// If `descriptor` is below zero, nothing is sent.
  explicit WorkerEvents(int descriptor) : descriptor_(descriptor) {}

  void SendProgress(const v1::Progress& progress) const;
  void SendError(const absl::Status& status) const;

 private:
  int descriptor_;
};

}  // namespace carillon::precompute
