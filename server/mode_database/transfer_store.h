// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/transfer.pb.h"
#include "server/base/clock.h"
#include "server/base/mutex.h"
#include "server/base/replaceable_callback.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/transfer.h"
#include "server/mode_database/codec/transfer_codec.h"
#include "server/mode_database/replacing.h"

namespace carillon {

class Database;

/// A stored transfer without its arrays.
struct TransferSummary {
  v1::TransferHeader header{};
  uint64_t stored_bytes = 0;
  int64_t created_unix_ms = 0;
};

/// Speed of sound in air by which speed ratios are defined, m/s.
inline constexpr double kSoundSpeedInAirMPerS = 343;

/// Returns the step number under which transfers with nearly the same speed ratio s are stored: 100
/// ln s, rounded. Speed ratios of neighbouring steps differ by about one percent.
int64_t SpeedStep(double speed_ratio);

/// Stores the transfers of modal models by model and speed ratio. A transfer belongs to one
/// revision of a model and is deleted with that revision. Safe from every thread.
///
/// Every call ignores a transfer whose bytes were damaged on the disk. Such a transfer can be
/// computed again.
class TransferStore {
 public:
  /// A transfer serves every material whose ln s differs by at most this from the transfer's ln s;
  /// the power then differs by up to 2 dB.
  static constexpr double kSpeedTolerance = 0.05;

  /// Called after each transfer that is stored. The store holds no lock during the call.
  using OnStored = std::function<void(const std::string& model_digest)>;

  TransferStore(Database& database, const Clock& clock) : database_(&database), clock_(&clock) {}

  /// Replaces the listener. When the call returns, the old listener is not running, and it is never
  /// called again. Must not be called by a listener.
  void Listen(OnStored on_stored);

  /// Stores a transfer of the model durably; replaces a transfer with the same step number. Without
  /// kAlways, a transfer that is the same byte for byte as the stored one changes nothing. With
  /// kUnlessPinned, a pinned model keeps the transfers that it has, but may get others; with kNever
  /// a model gets no transfer that it does not have. Errors: NotFound (MODAL_MODEL_NOT_FOUND),
  /// InvalidArgument (TRANSFER_MALFORMED: its modes are not the model's), AlreadyExists
  /// (MODAL_MODEL_EXISTS: refused by `replacing`).
  absl::StatusOr<TransferSummary> Put(const std::string& model_digest,
                                      const StoredTransfer& transfer,
                                      Replacing replacing = Replacing::kAlways);

  /// Stores the transfer in a file, as Put does. Further errors: those of StoredTransfer::ReadFile.
  absl::StatusOr<TransferSummary> PutFile(const std::string& model_digest,
                                          const std::filesystem::path& file);

  /// Returns the summaries of a model's transfers by ascending speed ratio.
  absl::StatusOr<std::vector<TransferSummary>> List(const std::string& model_digest);

  /// Returns a model's transfers with their arrays by ascending speed ratio.
  absl::StatusOr<std::vector<StoredTransfer>> Read(const std::string& model_digest);

  /// Returns the transfer of this revision of the model that is nearest to a material with sqrt(E /
  /// rho) = `material_m_per_s`. Returns null if no transfer is within kSpeedTolerance, or if the
  /// nearest cannot be read. All objects share one copy in memory.
  std::shared_ptr<const Transfer> Find(const ModalModel& model, double material_m_per_s);

 private:
  using Key = std::pair<int64_t, int64_t>;  // revision, step number

  /// Returns the transfer in memory whose bytes have this hash; if there is none, keeps `read`,
  /// which may be null, and returns it.
  std::shared_ptr<const Transfer> Share(Key key, int64_t xxh3,
                                        std::shared_ptr<const Transfer> read);

  Database* database_;
  const Clock* clock_;
  ReplaceableCallback<const std::string&> on_stored_;
  Mutex cache_mutex_;  // never locked while the disk is read
  std::map<Key, std::pair<int64_t, std::weak_ptr<const Transfer>>> cache_
      ABSL_GUARDED_BY(cache_mutex_);  // each transfer with the hash of its bytes
};

}  // namespace carillon
