// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "carillon/v1/audio_service.grpc.pb.h"
#include "server/api/call/raw_service.h"
#include "server/api/call/reception.h"
#include "server/api/edge/idle_calls.h"
#include "server/api/edge/scene_owners.h"
#include "server/base/clock.h"
#include "server/live_output/live_output.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/head_store.h"
#include "server/scene/scene_registry.h"
#include "server/scene/sounding_body.h"

namespace carillon {

/// The parts of the daemon that the calls about sound use.
struct AudioContext {
  std::string version;
  LiveOutput& output;
  const SceneRegistry& scenes;
  const SceneOwners& owners;
  ModeDatabase& database;
  HeadStore& heads;
  const Clock& clock;
  IdleCalls& idle_calls;
  Reception reception;  ///< its pool runs the offline renderings
};

/// carillon.v1.AudioService. The objects that the constructor gets by reference must outlive the
/// service.
class AudioService final : public RawService<v1::AudioService> {
 public:
  explicit AudioService(AudioContext daemon) : daemon_(std::move(daemon)) {
    ReadRaw("Render", &AudioService::RenderRaw);
    ReadRaw("Perform", &AudioService::PerformRaw);
  }

  grpc::ServerWriteReactor<v1::ListenResponse>* Listen(grpc::CallbackServerContext* context,
                                                       const v1::ListenRequest* request) override;
  grpc::ServerUnaryReactor* GetMixer(grpc::CallbackServerContext* context,
                                     const v1::GetMixerRequest* request,
                                     v1::GetMixerResponse* response) override;
  grpc::ServerUnaryReactor* UpdateMixer(grpc::CallbackServerContext* context,
                                        const v1::UpdateMixerRequest* request,
                                        v1::UpdateMixerResponse* response) override;

 private:
  grpc::ServerBidiReactor<grpc::ByteBuffer, v1::RenderResponse>* RenderRaw(
      grpc::CallbackServerContext* context);
  grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PerformResponse>* PerformRaw(
      grpc::CallbackServerContext* context);
  /// Returns the call that `make` makes, with its places among those of its client.
  template <typename Make>
  auto OpenRendering(grpc::CallbackServerContext* context, Make make, const char* function);
  /// Returns the bus of a scene, or nothing for the output if the name is empty. Errors: those of
  /// SceneOwners::Parse.
  absl::StatusOr<std::optional<BusId>> HeardBus(const grpc::CallbackServerContext& context,
                                                const Principal& caller,
                                                const std::string& scene_name) const;
  void Describe(v1::GetMixerResponse& mixer) const;

  const AudioContext daemon_;
  BodyCache render_bodies_;
};

}  // namespace carillon
