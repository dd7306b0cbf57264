// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/output.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {

absl::Status ShowInfo(const client::Client& daemon, const std::string& server, bool json) {
  ASSIGN_OR_RETURN(const v1::GetServerInfoResponse info, daemon.GetServerInfo());
  if (json) {
    PrintJson(info);
    return absl::OkStatus();
  }
  const v1::ServerLimits& limits = info.limits();
  absl::PrintF("carillond %s at %s\n", info.version(), server);
  absl::PrintF("up       %.0f s, output %d Hz, %d channels\n", info.uptime_s(),
               info.sample_rate_hz(), info.channel_count());
  absl::PrintF("features %s\n", absl::StrJoin(info.features(), ", "));
  absl::PrintF("limits   %d scenes, %d objects, %d modes of an object that sound\n",
               limits.scene_count(), limits.object_count(), limits.sounding_mode_count());
  absl::PrintF("         %d contact streams, %d listeners, %d renderings, %d waiting jobs\n",
               limits.contact_stream_count(), limits.listener_count(), limits.rendering_count(),
               limits.waiting_job_count());
  absl::PrintF("         of these %.0f %% for one client\n", limits.client_share() * 100);
  absl::PrintF("         %d bytes a message, %d bytes a mesh file, %d entries a page\n",
               limits.message_bytes(), limits.mesh_bytes(), limits.page_size());
  absl::PrintF("         a scene waits %.0f s for its clients\n", limits.scene_grace_s());
  return absl::OkStatus();
}

absl::Status ShowStatus(const client::Client& daemon, const std::string& server, bool json) {
  ASSIGN_OR_RETURN(const auto mixer, daemon.GetMixer());
  if (json) {
    PrintJson(mixer);
    return absl::OkStatus();
  }
  absl::PrintF("carillond %s at %s\n", mixer.version(), server);
  absl::PrintF("device   %s: %d Hz, %d channels, %d frames a block, SIMD %s\n", mixer.device(),
               mixer.format().sample_rate_hz(), mixer.format().channel_count(),
               mixer.block_frame_count(), mixer.simd_target());
  if (!mixer.device_message().empty()) absl::PrintF("         %s\n", mixer.device_message());
  absl::PrintF("latency  %.1f ms from the mixer to the ear\n", mixer.output_latency_s() * 1e3);
  absl::PrintF("sound    %d objects, %d modes ring, load %.0f %%\n", mixer.object_count(),
               mixer.active_mode_count(), mixer.load() * 100);
  absl::PrintF("level    peak %s (%.3g Pa), last 0.4 s %s, last 3 s %s\n", Decibels(mixer.peak()),
               mixer.peak_pa(), Loudness(mixer.has_momentary_lufs(), mixer.momentary_lufs()),
               Loudness(mixer.has_short_term_lufs(), mixer.short_term_lufs()));
  absl::PrintF("         full scale is %.4g Pa, gain %.4g%s\n", mixer.full_scale_pa(), mixer.gain(),
               mixer.muted() ? ", muted" : "");
  absl::PrintF("missed   %d times, %d frames; limited %d of %d frames\n", mixer.xrun_count(),
               mixer.lost_frame_count(), mixer.limited_frame_count(), mixer.frame_count());
  if (mixer.merged_impulse_count() + mixer.shed_object_count() > 0) {
    absl::PrintF("overload %d impulses merged, %d shed, %d objects silenced\n",
                 mixer.merged_impulse_count(), mixer.shed_impulse_count(),
                 mixer.shed_object_count());
  }
  return absl::OkStatus();
}

}  // namespace carillon::cli
