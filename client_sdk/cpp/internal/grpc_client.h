// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/channel.h>

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "carillon/client.h"
#include "carillon/v1/admin_service.grpc.pb.h"
#include "carillon/v1/audio_service.grpc.pb.h"
#include "carillon/v1/contact_service.grpc.pb.h"
#include "carillon/v1/decomposition_service.grpc.pb.h"
#include "carillon/v1/job_run_service.grpc.pb.h"
#include "carillon/v1/modal_model_service.grpc.pb.h"
#include "carillon/v1/scene_service.grpc.pb.h"
#include "carillon/v1/server_service.grpc.pb.h"

namespace carillon::client {

/// The time limit of a call with one answer. It is far above the time of any such call; the slowest
/// call reads a large model from the disk.
inline constexpr auto kCallTimeout = std::chrono::seconds(60);
/// The time limit of a call for the daemon's health. The daemon answers it at once, because gRPC
/// answers for it.
inline constexpr auto kHealthTimeout = std::chrono::seconds(10);

/// The client that talks to a daemon: one gRPC channel, and one stub for each service.
class GrpcClient final : public Client {
 public:
  GrpcClient(const std::string& server, const ConnectOptions& options);

  absl::StatusOr<v1::GetServerInfoResponse> GetServerInfo() const override;
  absl::StatusOr<bool> IsServing(const std::string& service) const override;

  absl::StatusOr<std::string> UploadMesh(absl::string_view bytes) const override;
  absl::StatusOr<v1::Job> CreateModalModel(
      const v1::CreateModalModelRequest& request) const override;
  absl::StatusOr<v1::Job> CreateTransfer(const v1::CreateTransferRequest& request) const override;
  absl::StatusOr<v1::ModalModelSummary> GetModalModel(const std::string& name) const override;
  absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest& request) const override;
  absl::StatusOr<v1::ModalModelSummary> UpdateModalModel(
      const v1::UpdateModalModelRequest& request) const override;
  absl::Status ExportModalModel(const std::string& name, const RecordSink& sink) const override;
  absl::StatusOr<v1::ModalModelSummary> ImportModalModel(
      const std::function<absl::Status(const RecordSink&)>& send, const std::string& name,
      const std::string& label) const override;
  absl::Status DeleteModalModel(const std::string& name) const override;
  absl::StatusOr<std::vector<v1::CatalogueMaterial>> ListMaterials() const override;

  absl::StatusOr<v1::Job> GetJob(const std::string& name) const override;
  absl::StatusOr<v1::ListJobsResponse> ListJobsPage(
      const v1::ListJobsRequest& request) const override;
  absl::StatusOr<v1::Job> CancelJob(const std::string& name) const override;
  absl::StatusOr<v1::Job> WatchJob(
      const std::string& name, const std::function<void(const v1::Job&)>& on_change) const override;
  absl::Status WatchJobs(
      const v1::WatchJobsRequest& request,
      const std::function<bool(const v1::WatchJobsResponse&)>& on_answer) const override;

  absl::StatusOr<v1::CreateSceneResponse> CreateOrFindScene(
      const v1::CreateSceneRequest& request) const override;
  absl::StatusOr<v1::Scene> GetScene(const std::string& name) const override;
  absl::StatusOr<std::vector<v1::SoundingObject>> AddObjects(
      const v1::AddObjectsRequest& request) const override;
  absl::StatusOr<std::string> CreateScene(const v1::CreateSceneRequest& request) const override;
  absl::StatusOr<v1::Scene> UpdateScene(const v1::UpdateSceneRequest& request) const override;
  absl::StatusOr<uint32_t> StopAll(const std::string& scene) const override;
  absl::Status DeleteScene(const std::string& name) const override;
  absl::StatusOr<std::vector<v1::Scene>> ListScenes() const override;
  absl::StatusOr<std::vector<v1::SoundingObject>> ListObjects(
      const std::string& scene) const override;
  absl::StatusOr<v1::SoundingObject> AddObject(const v1::AddObjectRequest& request) const override;
  absl::StatusOr<v1::SoundingObject> UpdateObject(
      const v1::UpdateObjectRequest& request) const override;
  absl::Status RemoveObject(const std::string& name) const override;
  absl::Status UpdateListener(const v1::UpdateListenerRequest& request) const override;
  absl::StatusOr<std::unique_ptr<ContactStream>> StreamContacts(
      const v1::ContactStreamStart& start) const override;

  absl::Status RecordContacts(
      const std::string& scene, const std::function<void()>& on_begun,
      const std::function<bool(const v1::ContactTraceRecord&)>& on_record) const override;

  absl::Status ListenTo(const v1::ListenRequest& request,
                        const AudioCallback& on_block) const override;
  absl::Status Listen(const AudioCallback& on_block) const override;
  absl::StatusOr<v1::RenderSummary> Render(const v1::RenderSettings& settings,
                                           ContactTraceReader& trace,
                                           const AudioCallback& on_block) const override;
  absl::StatusOr<v1::RenderSummary> Render(
      const v1::RenderSettings& settings, ContactTraceReader& trace, const AudioCallback& on_block,
      const std::function<void(const v1::Blow&)>& on_blow) const override;
  absl::StatusOr<v1::GetMixerResponse> GetMixer() const override;
  absl::StatusOr<v1::UpdateMixerResponse> UpdateMixer(
      const v1::UpdateMixerRequest& request) const override;

  absl::Status FetchMesh(const JobRun& run, const std::string& file) const override;
  absl::Status ReportProgress(const JobRun& run, const v1::Progress& progress) const override;
  absl::Status UploadResult(const JobRun& run, const v1::RunEnd& end,
                            const std::string& model_file) const override;

  absl::StatusOr<v1::GetDatabaseStatsResponse> GetDatabaseStats() const override;
  absl::Status BackUpDatabase(const std::string& file) const override;
  absl::StatusOr<v1::CollectGarbageResponse> CollectGarbage(
      const v1::CollectGarbageRequest& request) const override;

 private:
  struct Stubs {
    Stubs(std::string address, std::string shown_token, std::shared_ptr<grpc::Channel> opened)
        : server(std::move(address)),
          token(std::move(shown_token)),
          channel(std::move(opened)),
          models(channel),
          decompositions(channel),
          scenes(channel),
          contacts(channel),
          audio(channel),
          admin(channel),
          job_runs(channel),
          info(channel) {}

    const std::string server;
    const std::string token;
    const std::shared_ptr<grpc::Channel> channel;
    v1::ModalModelService::Stub models;
    v1::DecompositionService::Stub decompositions;
    v1::SceneService::Stub scenes;
    v1::ContactService::Stub contacts;
    v1::AudioService::Stub audio;
    v1::AdminService::Stub admin;
    v1::JobRunService::Stub job_runs;
    v1::ServerService::Stub info;
  };

  // gRPC's stubs take their calls as changes, which the calls of a client are not.
  const std::unique_ptr<Stubs> stubs_;
};

}  // namespace carillon::client
