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
#include "server/scene/offline/offline_renderer.h"

namespace carillon {

/// Builds an offline renderer from the requests of one Render call.
class TraceReader {
 public:
  TraceReader(ModeDatabase& database, HeadStore& heads, BodyCache& bodies)
      : database_(database), heads_(heads), bodies_(bodies) {}

  /// Takes a request. Errors: InvalidArgument (TRACE_MALFORMED, and those of the objects'
  /// materials), NotFound (MODAL_MODEL_NOT_FOUND), and those of HeadStore, OfflineRenderer and
  /// ForwardRenderer.
  absl::Status Take(const v1::RenderRequest& request);

  /// Ends the trace after the last request. Errors: InvalidArgument (TRACE_MALFORMED: nothing was
  /// sent).
  absl::Status Finish();

  /// Returns the renderer, or null before the header was taken.
  OfflineRenderer* renderer() { return renderer_.get(); }

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
  absl::Status CheckUnit(const v1::ContactStep& step) const;

  ModeDatabase& database_;
  HeadStore& heads_;
  BodyCache& bodies_;
  std::optional<OfflineSettings> settings_;
  std::unique_ptr<OfflineRenderer> renderer_;  // set once the header was read
  double time_s_ = 0;                          // the earliest time that the next step may have
};

}  // namespace carillon
