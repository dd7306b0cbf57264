// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/base/mutex.h"

namespace carillon {

/// Memory that gRPC may take for the connections of one group of addresses over TCP.
inline constexpr size_t kTcpMemoryBytes = size_t{96} << 20U;

/// The kinds of places that clients hold for a while. The daemon has a bounded number of each kind.
enum class Holding {
  kScene,
  kContactStream,
  kListener,
  kRendering,
  kRenderingMib,  ///< memory of renderings, in MiB
  kUpload,
  kExport,
  kBackup
};
inline constexpr size_t kHoldingCount = 8;

/// Greatest number of traces that are rendered at a time.
inline constexpr size_t kMaxRenderingCount = 8;

/// Returns the memory that all renderings together may hold: a quarter of what the daemon may use
/// (UsableMemoryBytes), but at most 2 GiB.
size_t MostRenderingMib();

/// Greatest number of uploads of meshes and imports of models at a time.
inline constexpr size_t kMaxUploadCount = 64;

/// Greatest number of exports of models at a time. gRPC keeps some 2 MiB of each until its client
/// reads.
inline constexpr size_t kMaxExportCount = 64;

/// Greatest number of backups at a time. Each is a copy of the database on the same disk until it
/// is sent.
inline constexpr size_t kMaxBackupCount = 4;

class ClientLimits;

/// One scene, stream, listener, rendering, upload, export or backup of a client, or several. The
/// destructor gives the places back.
class ClientPlace {
 public:
  ClientPlace() = default;
  /// Holds no place until Grow takes some.
  ClientPlace(ClientLimits& limits, Holding holding, std::string client)
      : limits_(&limits), holding_(holding), client_(std::move(client)) {}
  ClientPlace(ClientPlace&& other) noexcept { *this = std::move(other); }
  ClientPlace& operator=(ClientPlace&& other) noexcept {
    std::swap(limits_, other.limits_);
    std::swap(holding_, other.holding_);
    std::swap(client_, other.client_);
    std::swap(count_, other.count_);
    return *this;
  }
  ~ClientPlace();

  /// Takes more places, so that this holds `count` of them. Nothing changes if this holds as many
  /// already. Errors: those of ClientLimits::Take.
  absl::Status Grow(size_t count);

  /// Returns the number of places of this kind that the client may hold at most.
  size_t most() const;

 private:
  ClientLimits* limits_ = nullptr;
  Holding holding_ = Holding::kScene;
  std::string client_;
  size_t count_ = 0;
};

/// Bounds the places of one client to a share of the places of all clients together, so that no
/// client can shut out all others. Safe from every thread.
class ClientLimits {
 public:
  /// `share` is above 0. A client may always hold one place of each kind. If `share` is 1, there is
  /// no limit for a single client.
  explicit ClientLimits(double share) : share_(share) {}

  /// Takes a place for a client. The place must not outlive the ClientLimits. Errors:
  /// ResourceExhausted (CLIENT_LIMIT_REACHED; TOO_MANY_CALLS: all clients together have reached the
  /// greatest number of uploads, exports, backups or renderings, or of their memory, at a time).
  absl::StatusOr<ClientPlace> Take(Holding holding, const std::string& client);

  /// Checks that a client that holds `held` of `whole` things may have `more` of them. `name` names
  /// the things, such as objects, which the caller counts. Errors: ResourceExhausted
  /// (CLIENT_LIMIT_REACHED).
  absl::Status Check(absl::string_view name, size_t whole, size_t held, size_t more) const;

  /// Returns the number of places that are taken.
  size_t count(Holding holding) const;

  /// Returns the number of `whole` places that one client may hold.
  static size_t ShareOf(size_t whole, double share);

 private:
  friend class ClientPlace;
  size_t MostOf(Holding holding) const;
  size_t CountAll(Holding holding) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Add(Holding holding, const std::string& client, size_t count);
  void GiveBack(Holding holding, const std::string& client, size_t count);

  const double share_;
  mutable Mutex mutex_;
  std::array<std::map<std::string, size_t>, kHoldingCount> held_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace carillon
