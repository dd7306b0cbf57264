// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/server_service.h"

#include "proto/cpp/limits.h"
#include "server/api/edge/client_limits.h"
#include "server/audio_device/block_broadcast.h"
#include "server/mode_database/mesh_store.h"
#include "server/mode_database/page_token.h"
#include "server/scene/scene_registry.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/mixer.h"

namespace carillon {

// Anybody may make this call, as those of the health service.
grpc::ServerUnaryReactor* ServerService::GetServerInfo(grpc::CallbackServerContext* context,
                                                       const v1::GetServerInfoRequest*,
                                                       v1::GetServerInfoResponse* response) {
  const std::chrono::duration<double> uptime = clock_.Monotonic() - started_;
  response->set_version(facts_.version);
  response->set_started_unix_ms(started_unix_ms_);
  response->set_uptime_s(uptime.count());
  response->set_sample_rate_hz(output_.format().sample_rate_hz);
  response->set_channel_count(output_.format().channel_count);
  response->set_certificate_end_unix_s(facts_.certificate_end.unix_s());
  DescribeFeatures(*response);
  DescribeLimits(*response->mutable_limits());
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

void ServerService::DescribeFeatures(v1::GetServerInfoResponse& info) const {
  if (facts_.binaural) info.add_features("binaural");
  if (facts_.can_decompose()) info.add_features("decomposition");
  info.add_features("job-filters");
  info.add_features("scene-ids");
  if (facts_.slurm) info.add_features("slurm");
  if (decompositions_.settings().transfers) info.add_features("transfers");
}

void ServerService::DescribeLimits(v1::ServerLimits& limits) const {
  limits.set_scene_count(SceneRegistry::kMaxSceneCount);
  limits.set_object_count(SceneRegistry::kMaxObjectCount);
  limits.set_sounding_mode_count(static_cast<uint32_t>(SoundingBand().most_modes));
  limits.set_contact_stream_count(static_cast<uint32_t>(MixerSettings().most_streams));
  limits.set_listener_count(BlockBroadcast::kMaxListenerCount);
  limits.set_rendering_count(kMaxRenderingCount);
  limits.set_waiting_job_count(static_cast<uint32_t>(decompositions_.settings().max_queued_count));
  limits.set_client_share(facts_.client_share);
  limits.set_message_bytes(kMaxMessageBytes);
  limits.set_mesh_bytes(MeshStore::kMaxByteCount);
  limits.set_page_size(kMaxPageSize);
  limits.set_scene_grace_s(facts_.scene_grace_s);
  limits.set_label_bytes(kMaxLabelBytes);
  limits.set_step_time_s(kLargestStepTimeS);
}

}  // namespace carillon
