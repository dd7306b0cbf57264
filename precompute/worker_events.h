// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "absl/status/status.h"
#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// Tells the process that started this one how the work goes on: WorkerEvent messages of
/// proto/carillon/v1/decomposition.proto, delimited, on an open descriptor. One thread at a time. A
/// reader that has gone away is no error: the result may still be wanted.
class WorkerEvents {
 public:
  /// `descriptor`: below zero says nothing to nobody.
  explicit WorkerEvents(int descriptor) : descriptor_(descriptor) {}

  void SendProgress(const v1::Progress& progress) const;
  void SendError(const absl::Status& status) const;

 private:
  int descriptor_;
};

}  // namespace carillon::precompute
