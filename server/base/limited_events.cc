// SPDX-License-Identifier: Apache-2.0
#include "server/base/limited_events.h"

#include <algorithm>

namespace carillon {

LimitedEvents::~LimitedEvents() {
  const MutexLock lock(&mutex_);
  SayWhatWasLeftOut();
}

void LimitedEvents::Log(const Event& event) {
  const MutexLock lock(&mutex_);
  if (!events_.Take(clock_.Monotonic())) {
    ++left_out_count_;
    left_out_level_ = std::max(left_out_level_, event.level());
    return;
  }
  SayWhatWasLeftOut();
  sink_(event);
}

void LimitedEvents::SayWhatWasLeftOut() {
  if (left_out_count_ == 0) return;
  sink_(Event("events_left_out", left_out_level_)
            .With("about", subject_)
            .With("count", left_out_count_));
  left_out_count_ = 0;
  left_out_level_ = LogLevel::kDebug;
}

}  // namespace carillon
