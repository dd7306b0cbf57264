// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/fair_queue.h"

#include <algorithm>

namespace carillon {
namespace {

constexpr size_t kMostRememberedClients = 256;

}  // namespace

void FairQueue::Add(const Entry& entry) { queues_[entry.client].insert(PlaceOf(entry)); }

void FairQueue::Remove(const Entry& entry) {
  const auto queue = queues_.find(entry.client);
  if (queue == queues_.end()) return;
  queue->second.erase(PlaceOf(entry));
  if (queue->second.empty()) queues_.erase(queue);
}

size_t FairQueue::size() const {
  size_t count = 0;
  for (const auto& [client, queue] : queues_) count += queue.size();
  return count;
}

size_t FairQueue::size(const std::string& client) const {
  const auto queue = queues_.find(client);
  return queue == queues_.end() ? 0 : queue->second.size();
}

std::optional<std::string> FairQueue::Next() const {
  if (queues_.empty()) return std::nullopt;
  const auto newest_start = [this](const auto& queue) { return NewestStart(queue.first); };
  const std::set<Place>& queue = std::ranges::min_element(queues_, {}, newest_start)->second;
  return std::get<std::string>(*queue.begin());
}

std::vector<absl::string_view> FairQueue::Order() const {
  struct Turn {
    uint64_t newest_start;
    std::set<Place>::const_iterator next, end;
  };
  std::vector<Turn> turns;
  for (const auto& [client, queue] : queues_) {
    turns.push_back({NewestStart(client), queue.begin(), queue.end()});
  }
  std::ranges::stable_sort(turns, {}, &Turn::newest_start);
  std::vector<absl::string_view> order;
  // Each client has one turn a round, because a start puts it behind all others.
  while (!turns.empty()) {
    for (Turn& turn : turns) order.emplace_back(std::get<std::string>(*turn.next++));
    std::erase_if(turns, [](const Turn& turn) { return turn.next == turn.end; });
  }
  return order;
}

uint64_t FairQueue::NewestStart(const std::string& client) const {
  const auto start = starts_.find(client);
  return start == starts_.end() ? 0 : start->second;
}

void FairQueue::NoteStart(const std::string& client) {
  starts_[client] = ++start_count_;
  if (starts_.size() <= kMostRememberedClients) return;
  // A client that is forgotten counts as new when it submits another job.
  starts_.erase(
      std::ranges::min_element(starts_, {}, [](const auto& start) { return start.second; }));
}

FairQueue::Place FairQueue::PlaceOf(const Entry& entry) {
  return {-entry.priority, entry.number, entry.digest};
}

}  // namespace carillon
