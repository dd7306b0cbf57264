// SPDX-License-Identifier: Apache-2.0
#include "server/api/flood_guard.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

/// gRPC's count of open calls may be ahead of its limit while calls end.
constexpr uint64_t kMostOpenCalls = 2 * kMaxCallsOfConnection;
constexpr std::chrono::milliseconds kPeriod(25);
/// Looking takes at most this share of a core, however many connections there are.
constexpr double kMostLoad = 0.02;
/// Time over which the rate of failed calls is averaged.
constexpr double kWindowS = 0.5;

double SecondsOf(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

std::string FindFlood(const ConnectionCalls& before, const ConnectionCalls& now, double seconds) {
  if (now.open_count() > kMostOpenCalls) {
    return absl::StrCat("it has ", now.open_count(), " open calls, and at most ",
                        kMaxCallsOfConnection, " are allowed");
  }
  const auto failed = static_cast<double>(now.failed_count - before.failed_count);
  if (failed <= kMaxFailedCallsPerSecond * std::max(seconds, kWindowS)) return "";
  return absl::StrCat("it has begun and cancelled ", failed, " calls within ",
                      std::ceil(10 * seconds) / 10, " s, and at most ", kMaxFailedCallsPerSecond,
                      " a second are allowed");
}

FloodGuard::FloodGuard(ConnectionGate& gate, LimitedLog& log)
    : gate_(gate), log_(log), thread_([this] { Run(); }) {}

FloodGuard::~FloodGuard() {
  stop_.release();
  thread_.join();
}

void FloodGuard::Run() {
  Clock::duration pause = kPeriod;
  while (!stop_.try_acquire_for(pause)) {
    const Clock::time_point begin = Clock::now();
    Look(begin);
    const double taken_s = SecondsOf(Clock::now() - begin);
    pause =
        std::max<Clock::duration>(kPeriod, std::chrono::duration_cast<Clock::duration>(
                                               std::chrono::duration<double>(taken_s / kMostLoad)));
  }
}

void FloodGuard::Look(Clock::time_point now) {
  std::map<std::string, Seen> still_open;
  for (const auto& [peer, calls] : ReadConnectionCalls()) {
    const auto found = seen_.find(peer);
    Seen seen = found == seen_.end() ? Seen{.calls = {}, .at = now} : found->second;
    // A peer's name may have come back with another connection.
    if (calls.begun_count < seen.calls.begun_count) seen = {.calls = {}, .at = now};
    const double seconds = SecondsOf(now - seen.at);
    const std::string flood = FindFlood(seen.calls, calls, seconds);
    if (!flood.empty() && gate_.Refuse(peer)) {
      log_.Warn(absl::StrCat("closed the connection ", peer, ": ", flood,
                             "; connections from there are refused for ",
                             ConnectionGate::kRefusal.count(), " s"));
    }
    if (seconds >= kWindowS) seen = {.calls = calls, .at = now};
    still_open.emplace(peer, seen);
  }
  seen_ = std::move(still_open);
}

}  // namespace carillon
