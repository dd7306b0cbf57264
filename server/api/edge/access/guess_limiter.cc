// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/guess_limiter.h"

#include <arpa/inet.h>

#include <iterator>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"

namespace carillon {
namespace {

constexpr size_t kMostSources = 4096;
constexpr size_t kPrefixBytes = 8;

}  // namespace

std::string AddressOfPeer(absl::string_view peer) {
  absl::string_view host = peer.substr(0, peer.rfind(':'));
  if (absl::StartsWith(host, "ipv4:127.")) return kLoopback;
  if (!absl::ConsumePrefix(&host, "ipv6:")) return std::string(host);
  std::string text = absl::StrReplaceAll(host, {{"%5B", ""}, {"%5D", ""}, {"[", ""}, {"]", ""}});
  text = text.substr(0, text.find('%'));
  in6_addr address{};
  if (inet_pton(AF_INET6, text.c_str(), &address) != 1) return std::string(host);
  if (IN6_IS_ADDR_V4MAPPED(&address)) return text;
  if (IN6_IS_ADDR_LOOPBACK(&address)) return kLoopback;
  return absl::BytesToHexString({reinterpret_cast<const char*>(address.s6_addr), kPrefixBytes});
}

bool GuessLimiter::TakeRight(absl::string_view peer, const std::string& name) {
  const MutexLock lock(&mutex_);
  Source& source = SourceOf(peer);
  if (source.known.contains(name)) return true;
  if (!source.wrong.Has(clock_.Monotonic())) return false;
  source.known.insert(name);
  return true;
}

bool GuessLimiter::TakeWrong(absl::string_view peer) {
  const MutexLock lock(&mutex_);
  return SourceOf(peer).wrong.Take(clock_.Monotonic());
}

GuessLimiter::Source& GuessLimiter::SourceOf(absl::string_view peer) {
  std::string address = AddressOfPeer(peer);
  if (sources_.size() >= kMostSources && !sources_.contains(address)) {
    const std::chrono::nanoseconds now = clock_.Monotonic();
    for (auto each = sources_.begin(); each != sources_.end();) {
      each = each->second.wrong.IsFull(now) ? sources_.erase(each) : std::next(each);
    }
    if (sources_.size() >= kMostSources) sources_.erase(sources_.begin());
  }
  return sources_[std::move(address)];
}

}  // namespace carillon
