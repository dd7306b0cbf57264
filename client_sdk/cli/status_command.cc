// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/output.h"

namespace carillon::cli {

absl::Status ShowStatus(const client::Client& daemon, const std::string& server, bool json) {
  const auto mixer = daemon.GetMixer();
  if (!mixer.ok()) return mixer.status();
  if (json) {
    PrintJson(*mixer);
    return absl::OkStatus();
  }
  absl::PrintF("carillond %s at %s\n", mixer->version(), server);
  absl::PrintF("device   %s: %d Hz, %d channels, %d frames a block, SIMD %s\n", mixer->device(),
               mixer->format().sample_rate_hz(), mixer->format().channel_count(),
               mixer->block_frame_count(), mixer->simd_target());
  if (!mixer->device_message().empty()) absl::PrintF("         %s\n", mixer->device_message());
  absl::PrintF("latency  %.1f ms from the mixer to the ear\n", mixer->output_latency_s() * 1e3);
  absl::PrintF("sound    %d objects, %d modes ring, load %.0f %%\n", mixer->object_count(),
               mixer->active_mode_count(), mixer->load() * 100);
  absl::PrintF("level    peak %s (%.3g Pa), last 0.4 s %s, last 3 s %s\n", Decibels(mixer->peak()),
               mixer->peak_pa(), Loudness(mixer->has_momentary_lufs(), mixer->momentary_lufs()),
               Loudness(mixer->has_short_term_lufs(), mixer->short_term_lufs()));
  absl::PrintF("         full scale is %.4g Pa, gain %.4g%s\n", mixer->full_scale_pa(),
               mixer->gain(), mixer->muted() ? ", muted" : "");
  absl::PrintF("missed   %d times, %d frames; limited %d of %d frames\n", mixer->xrun_count(),
               mixer->lost_frame_count(), mixer->limited_frame_count(), mixer->frame_count());
  if (mixer->merged_impulse_count() + mixer->shed_object_count() > 0) {
    absl::PrintF("overload %d impulses merged, %d shed, %d objects silenced\n",
                 mixer->merged_impulse_count(), mixer->shed_impulse_count(),
                 mixer->shed_object_count());
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
