// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "carillon/v1/decomposition.pb.h"

namespace carillon {

/// Receives every change of every job, in order and one call at a time. The queue holds locks
/// during these calls, so they must return soon and must not call the queue.
class JobSink {
 public:
  virtual ~JobSink() = default;

  /// Receives the present state of a job.
  virtual void Take(const v1::Job& job) = 0;

  /// Called once all jobs that waited or ran were taken. Changes follow.
  virtual void TakeBegin() = 0;
};

}  // namespace carillon
