// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/grpc_client.h"

#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <utility>

#include "client_sdk/cpp/internal/authorize.h"
#include "client_sdk/cpp/internal/contact_stream_call.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

/// Calls `stub.*method` of the daemon that `stubs` belong to, and returns its response.
template <class Stubs, class Stub, class Request, class Response>
absl::StatusOr<Response> Call(const Stubs& stubs, Stub& stub,
                              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                           Response*),
                              const Request& request) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kCallTimeout);
  Authorize(context, stubs.server, stubs.token);
  Response response;
  RETURN_IF_ERROR(FromRpc((stub.*method)(&context, request, &response), stubs.server));
  return response;
}

std::shared_ptr<grpc::ChannelCredentials> CredentialsFor(const ConnectOptions& options) {
  if (options.tls_roots_pem.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs = options.tls_roots_pem;
  ssl.pem_cert_chain = options.tls_certificate_pem;
  ssl.pem_private_key = options.tls_key_pem;
  return grpc::SslCredentials(ssl);
}

std::string TokenOf(const ConnectOptions& options) {
  if (!options.token.empty()) return options.token;
  const char* token = std::getenv("CARILLON_TOKEN");
  return token == nullptr ? "" : token;
}

/// Returns a channel to the daemon. $http_proxy is for other machines: a proxy could not reach this
/// one's loopback addresses.
std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server,
                                           const ConnectOptions& options) {
  grpc::ChannelArguments arguments;
  if (IsOnThisMachine(server)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(server, CredentialsFor(options), arguments);
}

template <class Request>
Request Named(const std::string& name) {
  Request request;
  request.set_name(name);
  return request;
}

}  // namespace

GrpcClient::GrpcClient(const std::string& server, const ConnectOptions& options)
    : stubs_(std::make_unique<Stubs>(server, TokenOf(options), OpenChannel(server, options))) {}

absl::StatusOr<v1::GetServerInfoResponse> GrpcClient::GetServerInfo() const {
  return Call(*stubs_, stubs_->info, &v1::ServerService::Stub::GetServerInfo,
              v1::GetServerInfoRequest());
}

absl::StatusOr<v1::Job> GrpcClient::CreateModalModel(
    const v1::CreateModalModelRequest& request) const {
  ASSIGN_OR_RETURN(auto response, Call(*stubs_, stubs_->models,
                                       &v1::ModalModelService::Stub::CreateModalModel, request));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::Job> GrpcClient::CreateTransfer(const v1::CreateTransferRequest& request) const {
  ASSIGN_OR_RETURN(auto response, Call(*stubs_, stubs_->models,
                                       &v1::ModalModelService::Stub::CreateTransfer, request));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::ModalModelSummary> GrpcClient::GetModalModel(const std::string& name) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->models, &v1::ModalModelService::Stub::GetModalModel,
                        Named<v1::GetModalModelRequest>(name)));
  return std::move(*response.mutable_modal_model());
}

absl::StatusOr<v1::ModalModelSummary> GrpcClient::UpdateModalModel(
    const v1::UpdateModalModelRequest& request) const {
  ASSIGN_OR_RETURN(auto response, Call(*stubs_, stubs_->models,
                                       &v1::ModalModelService::Stub::UpdateModalModel, request));
  return std::move(*response.mutable_modal_model());
}

absl::StatusOr<v1::ListModalModelsResponse> GrpcClient::ListModalModelsPage(
    const v1::ListModalModelsRequest& request) const {
  return Call(*stubs_, stubs_->models, &v1::ModalModelService::Stub::ListModalModels, request);
}

absl::Status GrpcClient::DeleteModalModel(const std::string& name) const {
  return Call(*stubs_, stubs_->models, &v1::ModalModelService::Stub::DeleteModalModel,
              Named<v1::DeleteModalModelRequest>(name))
      .status();
}

absl::StatusOr<std::vector<v1::CatalogueMaterial>> GrpcClient::ListMaterials() const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->models, &v1::ModalModelService::Stub::ListMaterials,
                        v1::ListMaterialsRequest()));
  return std::vector<v1::CatalogueMaterial>(response.materials().begin(),
                                            response.materials().end());
}

absl::StatusOr<v1::Job> GrpcClient::GetJob(const std::string& name) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->decompositions, &v1::DecompositionService::Stub::GetJob,
                        Named<v1::GetJobRequest>(name)));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::ListJobsResponse> GrpcClient::ListJobsPage(
    const v1::ListJobsRequest& request) const {
  return Call(*stubs_, stubs_->decompositions, &v1::DecompositionService::Stub::ListJobs, request);
}

absl::StatusOr<v1::Job> GrpcClient::CancelJob(const std::string& name) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->decompositions, &v1::DecompositionService::Stub::CancelJob,
                        Named<v1::CancelJobRequest>(name)));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::CreateSceneResponse> GrpcClient::CreateOrFindScene(
    const v1::CreateSceneRequest& request) const {
  return Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::CreateScene, request);
}

absl::StatusOr<v1::Scene> GrpcClient::GetScene(const std::string& name) const {
  ASSIGN_OR_RETURN(auto response, Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::GetScene,
                                       Named<v1::GetSceneRequest>(name)));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<std::vector<v1::SoundingObject>> GrpcClient::AddObjects(
    const v1::AddObjectsRequest& request) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::AddObjects, request));
  return std::vector<v1::SoundingObject>(response.objects().begin(), response.objects().end());
}

absl::StatusOr<std::string> GrpcClient::CreateScene(const v1::CreateSceneRequest& request) const {
  ASSIGN_OR_RETURN(auto response, CreateOrFindScene(request));
  return response.name();
}

absl::StatusOr<v1::Scene> GrpcClient::UpdateScene(const v1::UpdateSceneRequest& request) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::UpdateScene, request));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<uint32_t> GrpcClient::StopAll(const std::string& scene) const {
  v1::StopAllRequest request;
  request.set_scene(scene);
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::StopAll, request));
  return response.scene_count();
}

absl::Status GrpcClient::DeleteScene(const std::string& name) const {
  return Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::DeleteScene,
              Named<v1::DeleteSceneRequest>(name))
      .status();
}

absl::StatusOr<std::vector<v1::Scene>> GrpcClient::ListScenes() const {
  ASSIGN_OR_RETURN(auto response, Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::ListScenes,
                                       v1::ListScenesRequest()));
  return std::vector<v1::Scene>(response.scenes().begin(), response.scenes().end());
}

absl::StatusOr<std::vector<v1::SoundingObject>> GrpcClient::ListObjects(
    const std::string& scene) const {
  v1::ListObjectsRequest request;
  request.set_scene(scene);
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::ListObjects, request));
  return std::vector<v1::SoundingObject>(response.objects().begin(), response.objects().end());
}

absl::StatusOr<v1::SoundingObject> GrpcClient::AddObject(
    const v1::AddObjectRequest& request) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::AddObject, request));
  return std::move(*response.mutable_object());
}

absl::StatusOr<v1::SoundingObject> GrpcClient::UpdateObject(
    const v1::UpdateObjectRequest& request) const {
  ASSIGN_OR_RETURN(auto response,
                   Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::UpdateObject, request));
  return std::move(*response.mutable_object());
}

absl::Status GrpcClient::RemoveObject(const std::string& name) const {
  return Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::RemoveObject,
              Named<v1::RemoveObjectRequest>(name))
      .status();
}

absl::Status GrpcClient::UpdateListener(const v1::UpdateListenerRequest& request) const {
  return Call(*stubs_, stubs_->scenes, &v1::SceneService::Stub::UpdateListener, request).status();
}

absl::StatusOr<std::unique_ptr<ContactStream>> GrpcClient::StreamContacts(
    const v1::ContactStreamStart& start) const {
  return OpenContactStream(stubs_->contacts, stubs_->server, stubs_->token, start);
}

absl::StatusOr<v1::GetMixerResponse> GrpcClient::GetMixer() const {
  return Call(*stubs_, stubs_->audio, &v1::AudioService::Stub::GetMixer, v1::GetMixerRequest());
}

absl::StatusOr<v1::UpdateMixerResponse> GrpcClient::UpdateMixer(
    const v1::UpdateMixerRequest& request) const {
  return Call(*stubs_, stubs_->audio, &v1::AudioService::Stub::UpdateMixer, request);
}

}  // namespace carillon::client
