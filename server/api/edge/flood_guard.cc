// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/flood_guard.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/api/edge/client_limits.h"

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
/// A connection with fewer open calls is not closed for the calls of its source.
constexpr uint64_t kFewCalls = 16;
/// Unfinished messages of open calls take at most gRPC's memory.
constexpr uint64_t kMostUnfinishedBytes = kTcpMemoryBytes;
/// A client answers received bytes with 1/1000 as many or fewer, and sends some pings a minute.
constexpr uint64_t kReceivedPerSent = 64;
constexpr double kPingBytesPerSecond = 1024;
/// Time over which the rate of failed calls is averaged.
constexpr double kWindowS = 0.5;
constexpr double kWindowOfSourceS = 1;
/// Sources without connections are remembered for this time.
constexpr std::chrono::seconds kSweepPeriod(2);

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

uint64_t MostIdleBytes(uint64_t open_count, uint64_t acknowledged, double seconds) {
  return kMostIdleBytes + std::min<uint64_t>(open_count * kMaxMessageBytes, kMostUnfinishedBytes) +
         acknowledged / kReceivedPerSent + static_cast<uint64_t>(kPingBytesPerSecond * seconds);
}

FloodGuard::Clock::duration FloodGuard::Look() {
  // A flood keeps this thread waiting for a processor, which must not make the guard look less
  // often. Therefore processor time is measured.
  const double begin_s = ProcessorTimeS();
  LookAtConnections(Clock::now());
  const double taken_s = ProcessorTimeS() - begin_s;
  return std::max<Clock::duration>(kPeriod,
                                   std::chrono::duration_cast<Clock::duration>(
                                       std::chrono::duration<double>(taken_s / kMostLoad)));
}

void FloodGuard::LookAtConnections(Clock::time_point now) {
  WatchNewConnections(now);
  if (now >= next_sweep_) {
    next_sweep_ = now + kSweepPeriod;
    std::erase_if(sources_, [now](const auto& each) {
      return each.second.connection_count == 0 && now - each.second.since > kSweepPeriod;
    });
  }
  for (const int64_t id : ChooseConnections()) LookAt(watched_.find(id), now);
}

void FloodGuard::WatchNewConnections(Clock::time_point now) {
  const int64_t first_id = watched_.empty() ? 0 : watched_.rbegin()->first + 1;
  for (GrpcConnection& connection : ListConnections(first_id)) {
    std::string source = SourceOfPeer(connection.peer);
    ++sources_[source].connection_count;
    watched_[connection.id] = {
        .peer = std::move(connection.peer), .source = std::move(source), .calls = {}, .since = now};
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

void FloodGuard::CountForSource(Watched& watched, const ConnectionCalls* now) {
  Source& source = sources_[watched.source];
  const ConnectionCalls before = std::exchange(watched.newest, now ? *now : ConnectionCalls());
  if (now == nullptr) --source.connection_count;
  if (now != nullptr) watched.busy = now->begun_count != before.begun_count;
  if (watched.refused) return;
  source.open_count -= before.open_count();
  source.failed_count +=
      now == nullptr ? before.open_count() : now->failed_count - before.failed_count;
  if (now != nullptr) source.open_count += now->open_count();
}

void FloodGuard::LeaveSource(Watched& watched) {
  if (std::exchange(watched.refused, true)) return;
  sources_[watched.source].open_count -= watched.newest.open_count();
}

std::string FloodGuard::FindFloodOfSource(Source& source, Clock::time_point now) {
  if (source.open_count > kMaxCallsOfSource) {
    return absl::StrCat("it has ", source.open_count, " open calls on ", source.connection_count,
                        " connections, and at most ", kMaxCallsOfSource, " are allowed");
  }
  const double seconds = std::max(SecondsOf(now - source.since), kWindowOfSourceS);
  const auto failed = static_cast<double>(source.failed_count);
  if (SecondsOf(now - source.since) > kWindowOfSourceS) {
    source.failed_count = 0;
    source.since = now;
  }
  if (failed <= kMaxFailedCallsOfSource * seconds) return "";
  return absl::StrCat("it has begun and left ", failed, " calls within ",
                      std::ceil(10 * seconds) / 10, " s, and at most ", kMaxFailedCallsOfSource,
                      " a second are allowed");
}

std::string FloodGuard::FindIdleBytes(Watched& watched, const ConnectionCalls& calls,
                                      const TcpBytes& bytes, Clock::time_point now) {
  // The counts fall if another connection has got the name of one that has just ended.
  if (calls.progress() != watched.progress || bytes.received < watched.bytes.received ||
      bytes.acknowledged < watched.bytes.acknowledged) {
    watched.progress = calls.progress();
    watched.bytes = bytes;
    watched.progressed = now;
  }
  const uint64_t idle = bytes.received - watched.bytes.received;
  const uint64_t acknowledged = bytes.acknowledged - watched.bytes.acknowledged;
  if (idle <=
      MostIdleBytes(calls.open_count(), acknowledged, SecondsOf(now - watched.progressed))) {
    return "";
  }
  return absl::StrCat("it has sent ", idle >> 20U,
                      " MiB that are neither calls nor whole messages, such as headers without an "
                      "end");
}

void FloodGuard::LookAt(WatchedById::iterator at, Clock::time_point now) {
  Watched& watched = at->second;
  // The bytes are read first, because a call or message that comes meanwhile explains them.
  const std::optional<TcpBytes> bytes = gate_.CountBytes(watched.peer);
  const std::optional<ConnectionCalls> calls = ReadConnectionCalls(at->first);
  CountForSource(watched, calls ? &*calls : nullptr);
  const auto source = sources_.find(watched.source);
  const std::string flood_of_source = FindFloodOfSource(source->second, now);
  if (!flood_of_source.empty() && gate_.RefuseSource(watched.peer)) {
    log_.Warn(absl::StrCat("refuses connections of ", watched.source, " for ",
                           gate_.RefusalTimeOf(watched.peer).count(), " s: ", flood_of_source));
  }
  if (!calls) {
    watched_.erase(at);
    return;
  }
  const double seconds = SecondsOf(now - watched.since);
  if (bytes) {
    const std::string idle = FindIdleBytes(watched, *calls, *bytes, now);
    if (!idle.empty() && gate_.End(watched.peer)) {
      log_.Warn(absl::StrCat("closed the connection ", watched.peer, ": ", idle));
    }
  }
  std::string flood = FindFlood(watched.calls, *calls, seconds);
  const bool helps = calls->open_count() >= kFewCalls;
  if (flood.empty() && helps && source->second.open_count > kMaxCallsOfSource) {
    flood = flood_of_source;
  }
  if (!flood.empty() && gate_.Refuse(watched.peer)) {
    LeaveSource(watched);
    log_.Warn(absl::StrCat("closed the connection ", watched.peer, ": ", flood,
                           "; connections from there are refused for ",
                           gate_.RefusalTimeOf(watched.peer).count(), " s"));
  }
  if (seconds < kWindowS) return;
  watched.calls = *calls;
  watched.since = now;
}

}  // namespace carillon
