// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "carillon/v1/contact_service.pb.h"
#include "carillon/v1/contact_trace.pb.h"
#include "server/base/mutex.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// Takes the records of one contact stream, for a client that reads them. Safe from every thread.
class TraceRecorder {
 public:
  /// Greatest number of records that may wait for the client, and of their bytes in memory.
  static constexpr size_t kMostWaiting = 65536;
  static constexpr size_t kMostWaitingBytes = size_t{16} << 20U;

  /// `wake` is called when there is a record to take, until Leave. It must not destroy the
  /// recorder.
  TraceRecorder(uint64_t scene, std::function<void()> wake)
      : scene_(scene), wake_(std::move(wake)) {}

  /// Called when the client has gone. `wake` is not called after Leave has returned.
  void Leave();

  uint64_t scene() const { return scene_; }
  /// Adds a record, which recorders share. `byte_count` is the record's size in memory. Returns
  /// false if the recorder takes no more records, because it overflowed or its client has gone.
  bool Add(std::shared_ptr<const v1::ContactTraceRecord> record, size_t byte_count);
  void End();

  /// Takes the next record. Returns false if no record waits.
  bool TryTake(v1::ContactTraceRecord& record);
  /// Returns whether no further record will come.
  bool ended() const;
  /// Returns whether records were lost because too many waited.
  bool overflowed() const;

 private:
  void Wake();

  const uint64_t scene_;
  Mutex wake_mutex_;
  std::function<void()> wake_ ABSL_GUARDED_BY(wake_mutex_);
  mutable Mutex mutex_;
  struct Waiting {
    std::shared_ptr<const v1::ContactTraceRecord> record;
    size_t byte_count = 0;
  };
  std::deque<Waiting> waiting_ ABSL_GUARDED_BY(mutex_);
  size_t waiting_byte_count_ ABSL_GUARDED_BY(mutex_) = 0;
  bool left_ ABSL_GUARDED_BY(mutex_) = false;
  bool ended_ ABSL_GUARDED_BY(mutex_) = false;
  bool overflowed_ ABSL_GUARDED_BY(mutex_) = false;
};

/// The recorders that wait for a stream of their scene to begin. Safe from every thread.
class TraceRecorders {
 public:
  void Add(const std::shared_ptr<TraceRecorder>& recorder);

  /// Removes and returns the recorders of a scene in which a stream begins.
  std::vector<std::shared_ptr<TraceRecorder>> Take(uint64_t scene);

 private:
  Mutex mutex_;
  std::vector<std::weak_ptr<TraceRecorder>> waiting_ ABSL_GUARDED_BY(mutex_);
};

/// Writes one contact stream to its recorders. Only one thread at a time may use an object.
class StreamRecording {
 public:
  StreamRecording() = default;
  /// `start` is the start message of the stream. The recording must be made before the first step
  /// of the stream is read.
  StreamRecording(const SceneRegistry& scenes, uint64_t scene, const v1::ContactStreamStart& start,
                  std::vector<std::shared_ptr<TraceRecorder>> recorders);

  bool active() const { return !recorders_.empty(); }

  /// Notes the state of the objects before a step.
  void BeginStep();
  /// Adds a step that was read. `mapping` maps the step's times.
  void AddStep(const v1::ContactStep& step, const TimeMapping& mapping);
  void End();

 private:
  void Add(v1::ContactTraceRecord record);

  const SceneRegistry* scenes_ = nullptr;
  uint64_t scene_ = 0;
  v1::ContactTraceHeader header_;
  std::vector<std::shared_ptr<TraceRecorder>> recorders_;
  std::vector<v1::ContactTraceRecord> new_objects_;
  std::set<uint32_t> known_;
  bool begun_ = false;
};

}  // namespace carillon
