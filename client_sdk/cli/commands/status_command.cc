// SPDX-License-Identifier: Apache-2.0
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

void PrintServer(const v1::GetServerInfoResponse& info) {
  const v1::ServerLimits& limits = info.limits();
  absl::PrintF("up       %.0f s, features %s\n", info.uptime_s(),
               absl::StrJoin(info.features(), ", "));
  absl::PrintF("limits   %s, %s, %s of an object that sound\n",
               Counted(limits.scene_count(), "scene"), Counted(limits.object_count(), "object"),
               Counted(limits.sounding_mode_count(), "mode"));
  absl::PrintF(
      "         %s, %s, %s, %s\n", Counted(limits.contact_stream_count(), "contact stream"),
      Counted(limits.listener_count(), "listener"), Counted(limits.rendering_count(), "rendering"),
      Counted(limits.waiting_job_count(), "waiting job"));
  absl::PrintF("         of these %.0f %% for one client\n", limits.client_share() * 100);
  absl::PrintF("         %s a message, %s a mesh file, at most %d in a page\n",
               Counted(limits.message_bytes(), "byte"), Counted(limits.mesh_bytes(), "byte"),
               limits.page_size());
  absl::PrintF("         a scene waits %.0f s for its clients\n", limits.scene_grace_s());
}

void PrintMixer(const v1::GetMixerResponse& mixer) {
  absl::PrintF("device   %s: %d Hz, %s, %s a block, SIMD %s\n", mixer.device(),
               mixer.format().sample_rate_hz(), Counted(mixer.format().channel_count(), "channel"),
               Counted(mixer.block_frame_count(), "frame"), mixer.simd_target());
  if (!mixer.device_message().empty()) absl::PrintF("         %s\n", mixer.device_message());
  absl::PrintF("latency  %.1f ms from the mixer to the ear\n", mixer.output_latency_s() * 1e3);
  absl::PrintF("sound    %s, %s ringing, load %.0f %%\n", Counted(mixer.object_count(), "object"),
               Counted(mixer.active_mode_count(), "mode"), mixer.load() * 100);
  absl::PrintF("level    peak %s (%.3g Pa), last 0.4 s %s, last 3 s %s\n", Decibels(mixer.peak()),
               mixer.peak_pa(), Loudness(mixer.has_momentary_lufs(), mixer.momentary_lufs()),
               Loudness(mixer.has_short_term_lufs(), mixer.short_term_lufs()));
  absl::PrintF("         full scale is %.4g Pa, gain %.4g%s\n", mixer.full_scale_pa(), mixer.gain(),
               mixer.muted() ? ", muted" : "");
  absl::PrintF("missed   %s, %s; limited %d of %s\n", Counted(mixer.xrun_count(), "time"),
               Counted(mixer.lost_frame_count(), "frame"), mixer.limited_frame_count(),
               Counted(mixer.frame_count(), "frame"));
  if (mixer.merged_impulse_count() + mixer.shed_object_count() > 0) {
    absl::PrintF("overload %s merged, %d shed, %s silenced\n",
                 Counted(mixer.merged_impulse_count(), "impulse"), mixer.shed_impulse_count(),
                 Counted(mixer.shed_object_count(), "object"));
  }
}

}  // namespace

absl::Status ShowStatus(const client::Client& daemon, const std::string& server, bool json) {
  ASSIGN_OR_RETURN(const v1::GetMixerResponse mixer, daemon.GetMixer());
  ASSIGN_OR_RETURN(const v1::GetServerInfoResponse info, daemon.GetServerInfo());
  if (json) {
    absl::PrintF("%s\n", MessageJson(mixer, {{"server", JsonText{MessageJson(info)}}}));
    return absl::OkStatus();
  }
  absl::PrintF("carillond %s at %s\n", mixer.version(), server);
  PrintMixer(mixer);
  PrintServer(info);
  return absl::OkStatus();
}

}  // namespace carillon::cli
