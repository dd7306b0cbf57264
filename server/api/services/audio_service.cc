// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/audio_service.h"

#include <optional>
#include <utility>

#include "proto/cpp/status_macros.h"
#include "server/api/call/status_conversion.h"
#include "server/api/call/unary_call.h"
#include "server/api/services/listen_call.h"
#include "server/api/services/perform_call.h"
#include "server/api/services/render_call.h"
#include "server/synthesis/bank/oscillator_bank.h"

namespace carillon {

grpc::ServerWriteReactor<v1::ListenResponse>* AudioService::Listen(
    grpc::CallbackServerContext* context, const v1::ListenRequest* request) {
  return Open(*context, daemon_.reception, {Role::kListen, Holding::kListener},
              [&](const Principal& caller, ClientPlace place) {
                return MakeListenCall(daemon_.output, HeardBus(*context, caller, request->scene()),
                                      *request, std::move(place));
              });
}

absl::StatusOr<std::optional<BusId>> AudioService::HeardBus(
    const grpc::CallbackServerContext& context, const Principal& caller,
    const std::string& scene_name) const {
  if (scene_name.empty()) return std::nullopt;
  ASSIGN_OR_RETURN(const uint64_t scene,
                   daemon_.owners.Parse(context, caller, scene_name, SceneCall::kLooks));
  ASSIGN_OR_RETURN(const BusId bus, daemon_.scenes.BusOf(scene));
  return bus;
}

template <typename Make>
auto AudioService::OpenRendering(grpc::CallbackServerContext* context, Make make,
                                 const char* function) {
  return Open(
      *context, daemon_.reception, {Role::kStrike, Holding::kRendering},
      [this, context, make](const Principal& caller, ClientPlace place) {
        ClientLimits& limits = daemon_.reception.limits;
        return make({.database = daemon_.database,
                     .heads = daemon_.heads,
                     .bodies = render_bodies_,
                     .pool = daemon_.reception.pool,
                     .clock = daemon_.clock,
                     .idle_calls = daemon_.idle_calls},
                    *context,
                    {.call = std::move(place),
                     .memory = ClientPlace(limits, Holding::kRenderingMib, caller.client)});
      },
      function);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::RenderResponse>* AudioService::RenderRaw(
    grpc::CallbackServerContext* context) {
  return OpenRendering(context, MakeRenderCall, __func__);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PerformResponse>* AudioService::PerformRaw(
    grpc::CallbackServerContext* context) {
  return OpenRendering(context, MakePerformCall, __func__);
}

grpc::ServerUnaryReactor* AudioService::GetMixer(grpc::CallbackServerContext* context,
                                                 const v1::GetMixerRequest*,
                                                 v1::GetMixerResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const absl::Status admitted = daemon_.reception.access.Admit(*context, Role::kAny).status();
  if (admitted.ok()) Describe(*response);
  reactor->Finish(ToGrpcStatus(admitted));
  return reactor;
}

grpc::ServerUnaryReactor* AudioService::UpdateMixer(grpc::CallbackServerContext* context,
                                                    const v1::UpdateMixerRequest* request,
                                                    v1::UpdateMixerResponse* response) {
  const auto update = [this, request, response](const Principal& caller) {
    if (request->has_gain()) RETURN_IF_ERROR(ValidateGain(request->gain()));
    const OutputVolume volume = daemon_.output.ChangeVolume(
        request->has_gain() ? std::optional(request->gain()) : std::nullopt,
        request->has_muted() ? std::optional(request->muted()) : std::nullopt);
    response->set_gain(volume.gain);
    response->set_muted(volume.muted);
    daemon_.reception.events.Log(Event("mixer_changed")
                                     .With("gain", volume.gain)
                                     .With("muted", volume.muted ? "true" : "false"),
                                 caller);
    return absl::OkStatus();
  };
  return Answer(context, daemon_.reception, Role::kAdminister, update);
}

void AudioService::Describe(v1::GetMixerResponse& mixer) const {
  const LiveOutput& output = daemon_.output;
  const OutputState state = output.state();
  mixer.set_version(daemon_.version);
  mixer.set_device(state.device);
  mixer.mutable_format()->set_sample_rate_hz(output.format().sample_rate_hz);
  mixer.mutable_format()->set_channel_count(output.format().channel_count);
  mixer.set_block_frame_count(output.format().block_frame_count);
  mixer.set_output_latency_s(state.latency_s);
  mixer.set_frame_count(state.mixer.frame_count);
  mixer.set_object_count(static_cast<uint32_t>(daemon_.scenes.object_count()));
  mixer.set_active_mode_count(static_cast<uint32_t>(state.mixer.active_mode_count));
  mixer.set_load(state.load);
  mixer.set_xrun_count(state.xrun_count);
  mixer.set_lost_frame_count(state.lost_frame_count);
  mixer.set_limited_frame_count(state.mixer.limited_frame_count);
  mixer.set_peak(state.peak);
  mixer.set_full_scale_pa(output.full_scale_pa());
  mixer.set_peak_pa(state.peak * output.full_scale_pa());
  if (state.momentary_lufs) mixer.set_momentary_lufs(*state.momentary_lufs);
  if (state.short_term_lufs) mixer.set_short_term_lufs(*state.short_term_lufs);
  mixer.set_device_message(state.device_message);
  mixer.set_simd_target(std::string(SimdTarget()));
  mixer.set_merged_impulse_count(state.mixer.merged_count);
  mixer.set_shed_impulse_count(state.mixer.shed_count);
  mixer.set_shed_object_count(state.mixer.shed_bank_count);
  mixer.set_gain(output.volume().gain);
  mixer.set_muted(output.volume().muted);
}

}  // namespace carillon
