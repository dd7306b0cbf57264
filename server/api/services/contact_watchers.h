// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "carillon/v1/contact_service.pb.h"
#include "server/base/mutex.h"

namespace carillon {

/// Keeps the news of a scene's contact streams for one client that watches them. Safe from every
/// thread.
class ContactWatcher {
 public:
  /// Greatest number of messages that may wait for the client.
  static constexpr size_t kMostWaiting = 1024;

  /// `wake` is called when there is a message to take, until Leave. It must not destroy the
  /// watcher.
  ContactWatcher(uint64_t scene, std::function<void()> wake)
      : scene_(scene), wake_(std::move(wake)) {}

  /// Called when the client has gone. `wake` is not called after Leave has returned.
  void Leave();

  uint64_t scene() const { return scene_; }
  /// Adds a message, which watchers share, or counts it as lost.
  void Add(const std::shared_ptr<const v1::WatchContactsResponse>& news);

  /// Takes the next message. Returns false if none waits.
  bool TryTake(v1::WatchContactsResponse& news);

 private:
  const uint64_t scene_;
  Mutex wake_mutex_;
  std::function<void()> wake_ ABSL_GUARDED_BY(wake_mutex_);
  Mutex mutex_;
  std::deque<std::shared_ptr<const v1::WatchContactsResponse>> waiting_ ABSL_GUARDED_BY(mutex_);
  uint64_t lost_count_ ABSL_GUARDED_BY(mutex_) = 0;
};

/// The watchers of all scenes. Safe from every thread.
class ContactWatchers {
 public:
  void Add(const std::shared_ptr<ContactWatcher>& watcher);

  /// Returns whether anybody watches the scene. It costs one load while nobody watches any scene.
  bool IsWatched(uint64_t scene);

  void Tell(uint64_t scene, v1::WatchContactsResponse news);

  /// Returns a number for the next stream.
  uint64_t NumberStream() { return ++stream_count_; }

 private:
  std::vector<std::shared_ptr<ContactWatcher>> Of(uint64_t scene);

  std::atomic<uint64_t> stream_count_ = 0;
  std::atomic<bool> any_ = false;
  Mutex mutex_;
  std::vector<std::weak_ptr<ContactWatcher>> watchers_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
