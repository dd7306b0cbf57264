// SPDX-License-Identifier: Apache-2.0
#include "server/daemon/watchdog.h"

#include <systemd/sd-daemon.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kStatusPeriod(5000);

milliseconds Period() {
  uint64_t limit_us = 0;
  if (sd_watchdog_enabled(0, &limit_us) <= 0) return kStatusPeriod;
  const std::chrono::microseconds third(limit_us / 3);
  return std::min(kStatusPeriod, std::chrono::floor<milliseconds>(third));
}

std::string StatusOf(const OutputState& state) {
  const std::string trouble =
      state.device_message.empty() ? "" : absl::StrCat("; ", state.device_message);
  return absl::StrCat("STATUS=plays on ", state.device, " at a load of ",
                      static_cast<int>(100 * state.load), " %", trouble);
}

}  // namespace

Watchdog::Watchdog(LiveOutput& output)
    : output_(output), period_(Period()), last_frame_(output.mixer().frame()) {}

void Watchdog::Report() {
  const uint64_t frame = output_.mixer().frame();
  const std::string status = StatusOf(output_.state());
  sd_notify(0, (frame != last_frame_ ? absl::StrCat("WATCHDOG=1\n", status) : status).c_str());
  last_frame_ = frame;
}

}  // namespace carillon
