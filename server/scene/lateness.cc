// SPDX-License-Identifier: Apache-2.0
#include "server/scene/lateness.h"

#include <cmath>

#include "server/scene/offline_renderer.h"

namespace carillon {
namespace {

/// Two steps alone say nothing about those that follow.
constexpr uint64_t kFewestLateSteps = 3;
/// A recorded trace begins at a multiple of this.
constexpr uint64_t kGrainFrames = OfflineRenderer::kBlockFrameCount;

}  // namespace

void Lateness::Note(double time_s, uint64_t frame, TimeMapping& mapping) {
  const double late_frames = static_cast<double>(frame) - mapping.FrameOf(time_s, sample_rate_hz_);
  if (late_frames <= 0) {
    since_frame_.reset();
    return;
  }
  if (!since_frame_) {
    since_frame_ = frame;
    step_count_ = 0;
  }
  ++step_count_;
  const auto run_frames = static_cast<double>(frame - *since_frame_);
  if (step_count_ < kFewestLateSteps || run_frames < kLateRunS * sample_rate_hz_) return;
  const double grains =
      std::ceil((late_frames + mapping.delay_s * sample_rate_hz_) / double{kGrainFrames});
  mapping.first_frame += static_cast<uint64_t>(grains) * kGrainFrames;
  since_frame_.reset();
  ++remap_count_;
}

}  // namespace carillon
