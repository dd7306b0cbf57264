// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/contact_watchers.h"

namespace carillon {

void ContactWatcher::Leave() {
  const MutexLock lock(&wake_mutex_);
  wake_ = nullptr;
}

void ContactWatcher::Add(const std::shared_ptr<const v1::WatchContactsResponse>& news) {
  {
    const MutexLock lock(&mutex_);
    if (waiting_.size() >= kMostWaiting) {
      ++lost_count_;
      return;
    }
    waiting_.push_back(news);
  }
  const MutexLock lock(&wake_mutex_);
  if (wake_) wake_();
}

bool ContactWatcher::TryTake(v1::WatchContactsResponse& news) {
  std::shared_ptr<const v1::WatchContactsResponse> next;
  uint64_t lost_count = 0;
  {
    const MutexLock lock(&mutex_);
    if (waiting_.empty()) return false;
    next = std::move(waiting_.front());
    waiting_.pop_front();
    lost_count = lost_count_;
  }
  news = *next;
  news.set_lost_count(lost_count);
  return true;
}

void ContactWatchers::Add(const std::shared_ptr<ContactWatcher>& watcher) {
  const MutexLock lock(&mutex_);
  watchers_.push_back(watcher);
  any_ = true;
}

bool ContactWatchers::IsWatched(uint64_t scene) { return any_ && !Of(scene).empty(); }

void ContactWatchers::Tell(uint64_t scene, v1::WatchContactsResponse news) {
  const auto shared = std::make_shared<const v1::WatchContactsResponse>(std::move(news));
  for (const std::shared_ptr<ContactWatcher>& watcher : Of(scene)) watcher->Add(shared);
}

std::vector<std::shared_ptr<ContactWatcher>> ContactWatchers::Of(uint64_t scene) {
  std::vector<std::shared_ptr<ContactWatcher>> found;
  const MutexLock lock(&mutex_);
  std::erase_if(watchers_, [](const auto& watcher) { return watcher.expired(); });
  any_ = !watchers_.empty();
  for (const std::weak_ptr<ContactWatcher>& known : watchers_) {
    std::shared_ptr<ContactWatcher> watcher = known.lock();
    if (watcher != nullptr && watcher->scene() == scene) found.push_back(std::move(watcher));
  }
  return found;
}

}  // namespace carillon
