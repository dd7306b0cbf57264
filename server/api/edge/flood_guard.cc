// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/flood_guard.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

/// Time between two looks while some process or address comes near a limit.
constexpr std::chrono::milliseconds kQuickPeriod(5);
/// The guard takes at most this share of a core, however many connections there are.
constexpr double kMostLoad = 0.05;
/// A connection with fewer open and failed calls is not ended for the calls of its source.
constexpr uint64_t kFewCalls = 16;
/// A source with this part of its open or failed calls, or of the idle bytes, comes near a limit.
constexpr uint64_t kNearPart = 16;
/// A client answers received bytes with 1/1000 as many or fewer, and sends some pings a minute.
constexpr uint64_t kReceivedPerSent = 64;
constexpr double kPingBytesPerSecond = 1024;
constexpr std::chrono::seconds kSecond(1);

/// Returns the processor time that this thread has taken.
double ProcessorTimeS() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

double SecondsOf(FloodGuard::Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

uint64_t AllowedBytes(uint64_t acknowledged, double seconds) {
  return acknowledged / kReceivedPerSent + static_cast<uint64_t>(kPingBytesPerSecond * seconds);
}

FloodGuard::Clock::duration FloodGuard::Look() {
  // A flood keeps this thread waiting for a processor, which must not make the guard look less
  // often. Therefore processor time is measured.
  const double begin_s = ProcessorTimeS();
  LookAtConnections(Clock::now());
  const double taken_s = ProcessorTimeS() - begin_s;
  const bool near = std::ranges::any_of(sources_, [](const auto& each) {
    const Source& source = each.second;
    return source.open_count > kMaxCallsOfSource / kNearPart ||
           source.failed_count > kMaxFailedCallsPerSecond / kNearPart ||
           source.idle_bytes > kMostIdleBytes / kNearPart;
  });
  return std::max<Clock::duration>(near ? kQuickPeriod : kPeriod,
                                   std::chrono::duration_cast<Clock::duration>(
                                       std::chrono::duration<double>(taken_s / kMostLoad)));
}

void FloodGuard::LookAtConnections(Clock::time_point now) {
  WatchNewConnections(now);
  BeginSecond(now);
  for (auto each = watched_.begin(); each != watched_.end();) {
    each = Read(each->first, each->second, now) ? std::next(each) : watched_.erase(each);
  }
  for (const auto& [name, source] : sources_) {
    const std::string flood = FindFlood(source, now);
    if (!flood.empty()) Refuse(name, flood);
  }
  for (const auto& [id, watched] : watched_) EndIfIdleBytes(watched, sources_[watched.source]);
}

void FloodGuard::WatchNewConnections(Clock::time_point now) {
  const int64_t first_id = watched_.empty() ? 0 : watched_.rbegin()->first + 1;
  for (GrpcConnection& connection : ListConnections(first_id)) {
    std::string source = SourceOfPeer(connection.peer);
    watched_[connection.id] = {
        .peer = std::move(connection.peer), .source = std::move(source), .progressed = now};
  }
}

void FloodGuard::BeginSecond(Clock::time_point now) {
  if (now - second_begin_ >= kSecond) {
    second_begin_ = now;
    sources_.clear();
    for (auto& [id, watched] : watched_) watched.failed_before = watched.calls.failed_count;
  }
  for (auto& [name, source] : sources_) source = {.failed_count = source.failed_count};
}

bool FloodGuard::Read(int64_t id, Watched& watched, Clock::time_point now) {
  // The bytes are read first, because a call or message that comes meanwhile explains them.
  const std::optional<TcpBytes> bytes = gate_.CountBytes(watched.peer);
  const std::optional<ConnectionCalls> calls = ReadConnectionCalls(id);
  Source& source = sources_[watched.source];
  if (!calls) {
    source.failed_count += watched.calls.open_count();
    return false;
  }
  source.failed_count += calls->failed_count - watched.calls.failed_count;
  source.open_count += calls->open_count();
  source.most_open_count = std::max(source.most_open_count, calls->open_count());
  ++source.connection_count;
  if (bytes) {
    // The bytes fall if another connection has got the name of one that has just ended.
    if (calls->progress() != watched.calls.progress() || bytes->received < watched.bytes.received ||
        bytes->acknowledged < watched.bytes.acknowledged) {
      watched.bytes = *bytes;
      watched.progressed = now;
    }
    const uint64_t received = bytes->received - watched.bytes.received;
    const uint64_t allowed = AllowedBytes(bytes->acknowledged - watched.bytes.acknowledged,
                                          SecondsOf(now - watched.progressed));
    watched.idle_bytes = received - std::min(received, allowed);
    source.idle_bytes += watched.idle_bytes;
  }
  watched.calls = *calls;
  return true;
}

std::string FloodGuard::FindFlood(const Source& source, Clock::time_point now) const {
  if (source.most_open_count > kMaxCallsOfConnection) {
    return absl::StrCat("it has ", source.most_open_count,
                        " open calls on one connection, and at most ", kMaxCallsOfConnection,
                        " are allowed");
  }
  if (source.open_count > kMaxCallsOfSource) {
    return absl::StrCat("it has ", source.open_count, " open calls on ", source.connection_count,
                        " connections, and at most ", kMaxCallsOfSource, " are allowed");
  }
  const double seconds = std::max(SecondsOf(now - second_begin_), 1.0);
  if (static_cast<double>(source.failed_count) <= kMaxFailedCallsPerSecond * seconds) return "";
  return absl::StrCat("it has begun and left ", source.failed_count, " calls within ",
                      std::ceil(10 * seconds) / 10, " s, and at most ", kMaxFailedCallsPerSecond,
                      " a second are allowed");
}

void FloodGuard::Refuse(const std::string& name, const std::string& flood) {
  int ended_count = 0;
  for (const auto& [id, watched] : watched_) {
    if (watched.source != name) continue;
    const uint64_t failed = watched.calls.failed_count - watched.failed_before;
    const bool helps = std::max(watched.calls.open_count(), failed) >= kFewCalls;
    if (helps && gate_.End(watched.peer)) ++ended_count;
  }
  if (!gate_.Refuse(name) && ended_count == 0) return;
  log_.Warn(absl::StrCat("closed ", ended_count, " connections of ", name,
                         ", and refuses new ones for ", ConnectionGate::RefusalTimeOf(name).count(),
                         " s: ", flood));
}

void FloodGuard::EndIfIdleBytes(const Watched& watched, const Source& source) {
  const bool helps =
      source.idle_bytes > kMostIdleBytesOfSource && watched.idle_bytes > kMostIdleBytes / kNearPart;
  if (watched.idle_bytes <= kMostIdleBytes && !helps) return;
  if (!gate_.End(watched.peer)) return;
  log_.Warn(absl::StrCat("closed the connection ", watched.peer, ": it has sent ",
                         watched.idle_bytes >> 20U,
                         " MiB that are neither calls nor whole messages, such as headers without "
                         "an end or messages in tiny frames"));
}

}  // namespace carillon
