// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/base/mutex.h"

namespace carillon {

/// The kinds of places that clients hold for a while; the daemon has a bounded number of each.
enum class Holding { kScene, kContactStream, kListener, kRendering };
inline constexpr size_t kHoldingCount = 4;

/// Traces that are rendered at a time.
inline constexpr size_t kMaxRenderingCount = 8;

class ClientLimits;

/// One scene, stream, listener or rendering of a client, given back by the destructor.
class ClientPlace {
 public:
  ClientPlace() = default;
  ClientPlace(ClientLimits& limits, Holding holding, std::string client)
      : limits_(&limits), holding_(holding), client_(std::move(client)) {}
  ClientPlace(ClientPlace&& other) noexcept { *this = std::move(other); }
  ClientPlace& operator=(ClientPlace&& other) noexcept {
    std::swap(limits_, other.limits_);
    std::swap(holding_, other.holding_);
    std::swap(client_, other.client_);
    return *this;
  }
  ~ClientPlace();

 private:
  ClientLimits* limits_ = nullptr;
  Holding holding_ = Holding::kScene;
  std::string client_;
};

/// Bounds what one client holds to a share of what all may hold together, so that nobody can shut
/// out all others. Safe from every thread.
class ClientLimits {
 public:
  /// `share` is above 0; a client may always hold one of each. With 1 a client has no limit of its
  /// own.
  explicit ClientLimits(double share) : share_(share) {}

  /// Errors: ResourceExhausted (CLIENT_LIMIT_REACHED). The place must not outlive this.
  absl::StatusOr<ClientPlace> Take(Holding holding, const std::string& client);

  /// Places that are taken now.
  size_t count(Holding holding) const;

  /// How many of `whole` one client may hold.
  static size_t ShareOf(size_t whole, double share);

 private:
  friend class ClientPlace;
  void GiveBack(Holding holding, const std::string& client);

  const double share_;
  mutable Mutex mutex_;
  std::array<std::map<std::string, size_t>, kHoldingCount> held_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
