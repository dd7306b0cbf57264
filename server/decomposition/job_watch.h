// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "server/decomposition/active_jobs.h"
#include "server/decomposition/job_sink.h"
#include "server/decomposition/watcher.h"

namespace carillon {

/// Ends a watch when it is destroyed. After that, the watch's function is neither running nor
/// called again. The function itself may destroy the JobWatch. The caller must hold no lock that
/// the function takes. A watch may outlive the queue.
class JobWatch {
 public:
  virtual ~JobWatch() = default;
};

/// Returns the watch of a job whose watcher is registered already.
std::unique_ptr<JobWatch> MakeJobWatch(const std::shared_ptr<ActiveJobs>& jobs, std::string digest,
                                       std::shared_ptr<Watcher> watcher);

/// Registers a sink of all jobs, and returns its watch. `sink` must outlive the watch.
std::unique_ptr<JobWatch> MakeJobWatch(const std::shared_ptr<ActiveJobs>& jobs, JobSink& sink);

}  // namespace carillon
