// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline/waiting_events.h"

#include <algorithm>

namespace carillon {

void WaitingEvents::Sort() {
  if (sorted_count_ == events_.size()) return;
  if (taken_count_ >= events_.size() / 2) {
    events_.erase(events_.begin(), events_.begin() + static_cast<ptrdiff_t>(taken_count_));
    sorted_count_ -= taken_count_;
    taken_count_ = 0;
  }
  const auto first = events_.begin() + static_cast<ptrdiff_t>(taken_count_);
  const auto middle = events_.begin() + static_cast<ptrdiff_t>(sorted_count_);
  // Most simulations report their contacts in order, or nearly so.
  if (!std::ranges::is_sorted(middle, events_.end(), {}, &MixerEvent::FirstSample)) {
    std::ranges::stable_sort(middle, events_.end(), {}, &MixerEvent::FirstSample);
  }
  if (first != middle && middle->FirstSample() < std::prev(middle)->FirstSample()) {
    std::ranges::inplace_merge(first, middle, events_.end(), {}, &MixerEvent::FirstSample);
  }
  sorted_count_ = events_.size();
}

}  // namespace carillon
