// SPDX-License-Identifier: Apache-2.0
#include "server/api/call/timetable.h"

#include <algorithm>
#include <utility>

namespace carillon {

void Timetable::Add(Task task) { entries_.push_back({.task = std::move(task), .due = {}}); }

void Timetable::Start() {
  thread_ = std::thread([this] {
    while (!stop_.try_acquire_for(*RunDue())) {
    }
  });
}

void Timetable::Stop() {
  if (!thread_.joinable()) return;
  stop_.release();
  thread_.join();
}

std::optional<Timetable::Clock::duration> Timetable::RunDue() {
  if (entries_.empty()) return std::nullopt;
  for (Entry& entry : entries_) {
    if (Clock::now() < entry.due) continue;
    const Clock::duration pause = entry.task();
    entry.due = Clock::now() + pause;
  }
  const auto next = std::ranges::min_element(entries_, {}, &Entry::due);
  return std::max(next->due - Clock::now(), Clock::duration::zero());
}

}  // namespace carillon
