// SPDX-License-Identifier: Apache-2.0
#include "server/api/audio_service.h"

#include "server/api/listen_call.h"
#include "server/api/render_call.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/bank/oscillator_bank.h"

namespace carillon {

grpc::ServerWriteReactor<v1::ListenResponse>* AudioService::Listen(grpc::CallbackServerContext*,
                                                                   const v1::ListenRequest*) {
  return MakeListenCall(output_);
}

grpc::ServerBidiReactor<v1::RenderRequest, v1::RenderResponse>* AudioService::Render(
    grpc::CallbackServerContext*) {
  return MakeRenderCall({.database = database_,
                         .bodies = render_bodies_,
                         .pool = render_pool_,
                         .call_count = rendering_count_});
}

grpc::ServerUnaryReactor* AudioService::GetMixer(grpc::CallbackServerContext* context,
                                                 const v1::GetMixerRequest*,
                                                 v1::GetMixerResponse* response) {
  const OutputState state = output_.state();
  response->set_version(version_);
  response->set_device(state.device);
  response->mutable_format()->set_sample_rate_hz(output_.format().sample_rate_hz);
  response->mutable_format()->set_channel_count(output_.format().channel_count);
  response->set_block_frame_count(output_.format().block_frame_count);
  response->set_output_latency_s(state.latency_s);
  response->set_frame_count(state.mixer.frame_count);
  response->set_object_count(static_cast<uint32_t>(scenes_.object_count()));
  response->set_active_mode_count(static_cast<uint32_t>(state.mixer.active_mode_count));
  response->set_load(state.load);
  response->set_xrun_count(state.xrun_count);
  response->set_lost_frame_count(state.lost_frame_count);
  response->set_limited_frame_count(state.mixer.limited_frame_count);
  response->set_peak(state.peak);
  response->set_peak_pa(state.peak * kFullScalePa);
  if (state.momentary_lufs) response->set_momentary_lufs(*state.momentary_lufs);
  if (state.short_term_lufs) response->set_short_term_lufs(*state.short_term_lufs);
  response->set_device_message(state.device_message);
  response->set_simd_target(std::string(SimdTarget()));
  response->set_merged_impulse_count(state.mixer.merged_count);
  response->set_shed_impulse_count(state.mixer.shed_count);
  response->set_shed_object_count(state.mixer.shed_bank_count);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

}  // namespace carillon
