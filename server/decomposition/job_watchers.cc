// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_watchers.h"

#include <utility>

namespace carillon {

void JobWatchers::Add(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  watchers_[digest].push_back(watcher);
}

void JobWatchers::Erase(const std::string& digest, const std::shared_ptr<Watcher>& watcher) {
  const auto watchers = watchers_.find(digest);
  if (watchers == watchers_.end()) return;
  std::erase(watchers->second, watcher);
  if (watchers->second.empty()) watchers_.erase(watchers);
}

Notice JobWatchers::Announce(const std::string& digest, const v1::Job& job) {
  TellSinks(job);
  return For(digest, job);
}

Notice JobWatchers::AnnounceEnd(const std::string& digest, const v1::Job& job) {
  Notice notice = Announce(digest, job);
  watchers_.erase(digest);
  return notice;
}

Notice JobWatchers::For(const std::string& digest, const v1::Job& job) {
  Notice notice{{}, job, ++version_};
  const auto watchers = watchers_.find(digest);
  if (watchers != watchers_.end()) notice.watchers = watchers->second;
  return notice;
}

}  // namespace carillon
