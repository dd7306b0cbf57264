// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "carillon/v1/audio_service.pb.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/head_store.h"
#include "server/scene/offline_renderer.h"

namespace carillon {

/// Builds an offline renderer from the requests of one Render call.
class TraceReader {
 public:
  static constexpr uint64_t kMaxImpulseCount = 4'000'000;

  TraceReader(ModeDatabase& database, HeadStore& heads, BodyCache& bodies)
      : database_(database), heads_(heads), bodies_(bodies) {}

  /// Takes a request. Errors: InvalidArgument (TRACE_MALFORMED, and those of the objects'
  /// materials), ResourceExhausted (TRACE_TOO_LARGE: too many objects or contacts), NotFound
  /// (MODAL_MODEL_NOT_FOUND), and those of HeadStore and OfflineRenderer.
  absl::Status Take(const v1::RenderRequest& request);

  /// Returns the renderer after the last request. Errors: InvalidArgument (TRACE_MALFORMED: nothing
  /// was sent).
  absl::StatusOr<std::unique_ptr<OfflineRenderer>> Finish();

  /// Returns the memory that the trace takes so far.
  size_t held_bytes() const { return renderer_ ? renderer_->held_bytes() : 0; }

  uint32_t sample_rate_hz() const { return settings_->sample_rate_hz; }
  uint32_t channel_count() const { return settings_->channel_count; }
  double full_scale_pa() const { return settings_->full_scale_pa; }

 private:
  absl::Status TakeSettings(const v1::RenderSettings& settings);
  absl::Status TakeRecord(const v1::ContactTraceRecord& record);
  absl::Status TakeHeader(const v1::ContactTraceHeader& header);
  absl::Status TakeClock(const v1::ContactTraceClock& clock);
  absl::Status TakeObject(const v1::ContactTraceObject& message);
  absl::Status TakeStep(const v1::ContactStep& step);
  absl::Status CheckTime(double time_s) const;

  ModeDatabase& database_;
  HeadStore& heads_;
  BodyCache& bodies_;
  std::optional<OfflineSettings> settings_;
  std::unique_ptr<OfflineRenderer> renderer_;  // set once the header was read
  double time_s_ = 0;                          // the earliest time that the next step may have
  uint64_t impulse_count_ = 0;                 // number of impulses and poses
  uint64_t object_count_ = 0;
};

}  // namespace carillon
