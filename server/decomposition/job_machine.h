// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <variant>

#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "server/decomposition/job/executor.h"
#include "server/decomposition/job_wishes.h"
#include "server/mode_database/job_store.h"

namespace carillon {

/// The stages of a job that has not ended:
///
///     kAwaitsCoarse -> kWaits -> kRuns -> ended
///                        ^         |
///                        +---------+-- kYields, kRunsThenWaits, kDeletedThenWaits
///                                  +-- kCancelled, kDeleted -> ended
///
/// From kRuns on a worker computes the job. In the later stages its run is to end, or to be
/// followed by another run.
enum class JobStage {
  kAwaitsCoarse,      ///< until the job of its coarse model has ended
  kWaits,             ///< for a worker and memory
  kRuns,              ///< its result is stored, and ends the job
  kRunsThenWaits,     ///< its result is stored, but is not the one that is wanted by now
  kYields,            ///< its run is ended to make room, and repeated
  kCancelled,         ///< its run is ended
  kDeleted,           ///< its model was deleted: its run is ended, and no result is stored
  kDeletedThenWaits,  ///< the same, but the model is wanted again
};

/// A job that waits or runs.
struct ActiveJob {
  JobRecord record{};                     ///< as the database has it
  v1::CreateModalModelRequest request{};  ///< the request so far that reaches farthest
  JobStage stage = JobStage::kWaits;
  v1::CreateModalModelRequest given{};  ///< the request that its run was given
  v1::Progress progress{};              ///< of the run
  /// The client in whose queue the job is. It is empty if no client is known to want the job.
  std::string client{};
  JobWishes wishes{};                  ///< the clients that want the job
  std::string waits_for{};             ///< digest of the coarse model's job, while kAwaitsCoarse
  bool coarse_ready = false;           ///< a coarse model is stored under the job's digest
  bool was_killed = false;             ///< somebody else ended its worker once
  uint64_t number = 0;                 ///< order in which jobs of one priority start
  uint64_t guess_bytes = 0;            ///< predicted memory, before the correction by experience
  uint64_t estimate_bytes = 0;         ///< predicted memory
  std::chrono::nanoseconds started{};  ///< monotonic clock at the start of the run
  int64_t started_unix_ms = 0;         ///< at the start of the run

  bool runs() const { return stage >= JobStage::kRuns; }
  /// Whether the model was deleted while the job runs.
  bool deleted() const {
    return stage == JobStage::kDeleted || stage == JobStage::kDeletedThenWaits;
  }
};

/// Another request asks for the job.
struct Submitted {
  v1::CreateModalModelRequest request;
  std::string client{};
};

/// A client wants the job, too.
struct Wished {
  std::string client;
};

/// The model of a transfer's job is stored anew, by a job that these clients want.
struct ModelReplaced {
  JobWishes wishes;
};

/// A client wants the job no more, while another does.
struct Withdrawn {
  std::string client;
};

/// Nobody wants the job any more.
struct Cancelled {};

/// The job's model, or that of its transfer, was deleted.
struct ModelDeleted {};

/// The job of the coarse model has ended. `copied` tells whether it left a model.
struct CoarseEnded {
  bool copied = false;
};

/// The run of the job has ended.
struct RunEnded {
  Outcome outcome;
};

/// What can happen to a job, besides its start and its progress.
using JobEvent = std::variant<Submitted, Wished, ModelReplaced, Withdrawn, Cancelled, ModelDeleted,
                              CoarseEnded, RunEnded>;

/// What is to be done after an event.
enum class JobAction {
  kGoOn,       ///< nothing: the job waits or runs on
  kStopRun,    ///< end the job's run
  kWaitAgain,  ///< put the job behind those of its priority
  kEnd,        ///< forget the job; its record has the end
};

/// The job after an event, and what is to be done.
struct JobStep {
  ActiveJob job;
  JobAction action = JobAction::kGoOn;
  std::string note{};  ///< for the log; empty if there is nothing to tell
};

/// Returns what an event makes of a job. It asks nothing but its arguments, so the same event on
/// the same job always has the same result.
JobStep Transition(ActiveJob job, const JobEvent& event);

/// Returns whether nobody wanted the job any more, so that a request for it makes it run anew.
bool IsWantedNoMore(const ActiveJob& job);

}  // namespace carillon
