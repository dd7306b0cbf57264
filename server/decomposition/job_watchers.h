// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "carillon/v1/decomposition.pb.h"
#include "server/decomposition/job_sink.h"
#include "server/decomposition/watcher.h"

namespace carillon {

/// Those that want to know of changes of jobs: watchers of one job, and sinks of all. Gives every
/// change a version, by which a watcher knows the newest. Only one thread at a time may use an
/// object.
class JobWatchers {
 public:
  void Add(const std::string& digest, const std::shared_ptr<Watcher>& watcher);
  void Erase(const std::string& digest, const std::shared_ptr<Watcher>& watcher);
  void Add(JobSink& sink) { sinks_.insert(&sink); }
  void Erase(JobSink& sink) { sinks_.erase(&sink); }

  /// Tells the sinks of a change. Returns the notice for the watchers of the job, which the caller
  /// sends.
  Notice Announce(const std::string& digest, const v1::Job& job);

  /// Does the same with the last change of a job, whose watchers are forgotten.
  Notice AnnounceEnd(const std::string& digest, const v1::Job& job);

  /// Returns a notice for one watcher alone.
  Notice For(const std::shared_ptr<Watcher>& watcher, const v1::Job& job) {
    return {{watcher}, job, ++version_};
  }

  /// Returns a notice for the watchers of a job alone. It has no watchers if nobody watches the
  /// job.
  Notice For(const std::string& digest, const v1::Job& job);

  bool HasWatchers(const std::string& digest) const { return watchers_.contains(digest); }
  bool has_watchers() const { return !watchers_.empty(); }
  bool has_sinks() const { return !sinks_.empty(); }
  void TellSinks(const v1::Job& job) const {
    for (JobSink* sink : sinks_) sink->Take(job);
  }

 private:
  std::map<std::string, std::vector<std::shared_ptr<Watcher>>> watchers_;  ///< by digest
  std::set<JobSink*> sinks_;
  uint64_t version_ = 0;
};

}  // namespace carillon
