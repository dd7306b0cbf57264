// SPDX-License-Identifier: Apache-2.0
#include "server/api/flood_guard.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

/// While calls end, gRPC's count of open calls may exceed gRPC's limit.
constexpr uint64_t kMostOpenCalls = 2 * kMaxCallsOfConnection;
constexpr std::chrono::milliseconds kPeriod(5);
/// The guard takes at most this share of a core, however many connections there are.
constexpr double kMostLoad = 0.05;
/// Number of newest connections that are examined each time, in addition to the busy ones.
constexpr size_t kNewest = 64;
constexpr size_t kInTurn = 64;
/// Time over which the rate of failed calls is averaged.
constexpr double kWindowS = 0.5;

/// Returns the processor time that this thread has taken.
double ProcessorTimeS() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

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
    // A flood keeps this thread waiting for a processor, which must not make the guard look less
    // often. Therefore processor time is measured.
    const double begin_s = ProcessorTimeS();
    Look(Clock::now());
    const double taken_s = ProcessorTimeS() - begin_s;
    pause =
        std::max<Clock::duration>(kPeriod, std::chrono::duration_cast<Clock::duration>(
                                               std::chrono::duration<double>(taken_s / kMostLoad)));
  }
}

void FloodGuard::Look(Clock::time_point now) {
  WatchNewConnections(now);
  for (const int64_t id : ChooseConnections()) LookAt(watched_.find(id), now);
}

void FloodGuard::WatchNewConnections(Clock::time_point now) {
  const int64_t first_id = watched_.empty() ? 0 : watched_.rbegin()->first + 1;
  for (GrpcConnection& connection : ListConnections(first_id)) {
    watched_[connection.id] = {.peer = std::move(connection.peer), .calls = {}, .since = now};
  }
}

std::vector<int64_t> FloodGuard::ChooseConnections() {
  std::vector<int64_t> chosen;
  size_t rank = watched_.size();
  for (const auto& [id, watched] : watched_) {
    if (rank-- <= kNewest || watched.busy) chosen.push_back(id);
  }
  auto next = watched_.lower_bound(next_in_turn_);
  for (size_t i = 0; i < kInTurn && next != watched_.end(); ++i, ++next) {
    chosen.push_back(next->first);
  }
  next_in_turn_ = next == watched_.end() ? 0 : next->first;
  std::ranges::sort(chosen);
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

void FloodGuard::LookAt(WatchedById::iterator at, Clock::time_point now) {
  const std::optional<ConnectionCalls> calls = ReadConnectionCalls(at->first);
  if (!calls) {
    watched_.erase(at);
    return;
  }
  Watched& watched = at->second;
  watched.busy = calls->begun_count != watched.begun_count;
  watched.begun_count = calls->begun_count;
  const double seconds = SecondsOf(now - watched.since);
  const std::string flood = FindFlood(watched.calls, *calls, seconds);
  if (!flood.empty() && gate_.Refuse(watched.peer)) {
    log_.Warn(absl::StrCat("closed the connection ", watched.peer, ": ", flood,
                           "; connections from there are refused for ",
                           gate_.RefusalTimeOf(watched.peer).count(), " s"));
  }
  if (seconds < kWindowS) return;
  watched.calls = *calls;
  watched.since = now;
}

}  // namespace carillon
