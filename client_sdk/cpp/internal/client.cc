// SPDX-License-Identifier: Apache-2.0
#include "carillon/client.h"

#include <grpcpp/client_context.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <chrono>
#include <memory>
#include <utility>

#include "client_sdk/cpp/internal/contact_stream_call.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "client_sdk/cpp/internal/stubs.h"

namespace carillon::client {
namespace {

/// No call that answers once needs so long; reading a large model from the disk comes nearest.
constexpr auto kCallTimeout = std::chrono::seconds(60);
constexpr int kPageSize = 1000;

/// Calls `stub.*method` and returns its response.
template <class Stub, class Request, class Response>
absl::StatusOr<Response> Call(Stub& stub, const std::string& server,
                              grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                           Response*),
                              const Request& request) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kCallTimeout);
  Response response;
  const absl::Status status = FromRpc((stub.*method)(&context, request, &response), server);
  if (!status.ok()) return status;
  return response;
}

std::shared_ptr<grpc::ChannelCredentials> CredentialsFor(const std::string& tls_roots_pem) {
  if (tls_roots_pem.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions options;
  options.pem_root_certs = tls_roots_pem;
  return grpc::SslCredentials(options);
}

template <class Request>
Request Named(const std::string& name) {
  Request request;
  request.set_name(name);
  return request;
}

}  // namespace

Client::Client(const std::string& server, const std::string& tls_roots_pem)
    : stubs_(std::make_unique<Stubs>(server,
                                     grpc::CreateChannel(server, CredentialsFor(tls_roots_pem)))) {}
Client::Client(Client&&) noexcept = default;
Client& Client::operator=(Client&&) noexcept = default;
Client::~Client() = default;

absl::StatusOr<v1::Job> Client::CreateModalModel(const v1::CreateModalModelRequest& request) const {
  auto response =
      Call(stubs_->models, stubs_->server, &v1::ModalModelService::Stub::CreateModalModel, request);
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_job());
}

absl::StatusOr<v1::ModalModelSummary> Client::GetModalModel(const std::string& name) const {
  auto response = Call(stubs_->models, stubs_->server, &v1::ModalModelService::Stub::GetModalModel,
                       Named<v1::GetModalModelRequest>(name));
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_modal_model());
}

absl::StatusOr<v1::ModalModelSummary> Client::UpdateModalModel(
    const v1::UpdateModalModelRequest& request) const {
  auto response =
      Call(stubs_->models, stubs_->server, &v1::ModalModelService::Stub::UpdateModalModel, request);
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_modal_model());
}

absl::StatusOr<std::vector<v1::ModalModelSummary>> Client::ListModalModels(
    const v1::ListModalModelsRequest& filter) const {
  std::vector<v1::ModalModelSummary> models;
  v1::ListModalModelsRequest request = filter;
  request.clear_page_token();
  request.set_page_size(kPageSize);
  do {
    auto page = ListModalModelsPage(request);
    if (!page.ok()) return page.status();
    for (auto& model : *page->mutable_modal_models()) models.push_back(std::move(model));
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  return models;
}

absl::StatusOr<v1::ListModalModelsResponse> Client::ListModalModelsPage(
    const v1::ListModalModelsRequest& request) const {
  return Call(stubs_->models, stubs_->server, &v1::ModalModelService::Stub::ListModalModels,
              request);
}

absl::Status Client::DeleteModalModel(const std::string& name) const {
  return Call(stubs_->models, stubs_->server, &v1::ModalModelService::Stub::DeleteModalModel,
              Named<v1::DeleteModalModelRequest>(name))
      .status();
}

absl::StatusOr<std::vector<v1::CatalogueMaterial>> Client::ListMaterials() const {
  auto response = Call(stubs_->models, stubs_->server, &v1::ModalModelService::Stub::ListMaterials,
                       v1::ListMaterialsRequest());
  if (!response.ok()) return response.status();
  return std::vector<v1::CatalogueMaterial>(response->materials().begin(),
                                            response->materials().end());
}

absl::StatusOr<v1::Job> Client::GetJob(const std::string& name) const {
  auto response = Call(stubs_->decompositions, stubs_->server,
                       &v1::DecompositionService::Stub::GetJob, Named<v1::GetJobRequest>(name));
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_job());
}

absl::StatusOr<std::vector<v1::Job>> Client::ListJobs() const {
  std::vector<v1::Job> jobs;
  v1::ListJobsRequest request;
  request.set_page_size(kPageSize);
  do {
    auto page = Call(stubs_->decompositions, stubs_->server,
                     &v1::DecompositionService::Stub::ListJobs, request);
    if (!page.ok()) return page.status();
    for (auto& job : *page->mutable_jobs()) jobs.push_back(std::move(job));
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  return jobs;
}

absl::StatusOr<v1::Job> Client::CancelJob(const std::string& name) const {
  auto response =
      Call(stubs_->decompositions, stubs_->server, &v1::DecompositionService::Stub::CancelJob,
           Named<v1::CancelJobRequest>(name));
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_job());
}

absl::StatusOr<std::string> Client::CreateScene(const v1::CreateSceneRequest& request) const {
  auto response =
      Call(stubs_->scenes, stubs_->server, &v1::SceneService::Stub::CreateScene, request);
  if (!response.ok()) return response.status();
  return response->name();
}

absl::Status Client::DeleteScene(const std::string& name) const {
  return Call(stubs_->scenes, stubs_->server, &v1::SceneService::Stub::DeleteScene,
              Named<v1::DeleteSceneRequest>(name))
      .status();
}

absl::StatusOr<v1::SoundingObject> Client::AddObject(const v1::AddObjectRequest& request) const {
  auto response = Call(stubs_->scenes, stubs_->server, &v1::SceneService::Stub::AddObject, request);
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_object());
}

absl::StatusOr<v1::SoundingObject> Client::UpdateObject(
    const v1::UpdateObjectRequest& request) const {
  auto response =
      Call(stubs_->scenes, stubs_->server, &v1::SceneService::Stub::UpdateObject, request);
  if (!response.ok()) return response.status();
  return std::move(*response->mutable_object());
}

absl::Status Client::RemoveObject(const std::string& name) const {
  return Call(stubs_->scenes, stubs_->server, &v1::SceneService::Stub::RemoveObject,
              Named<v1::RemoveObjectRequest>(name))
      .status();
}

absl::Status Client::UpdateListener(const v1::UpdateListenerRequest& request) const {
  return Call(stubs_->scenes, stubs_->server, &v1::SceneService::Stub::UpdateListener, request)
      .status();
}

absl::StatusOr<std::unique_ptr<ContactStream>> Client::StreamContacts(
    const v1::ContactStreamStart& start) const {
  return OpenContactStream(stubs_->contacts, stubs_->server, start);
}

absl::StatusOr<v1::GetMixerResponse> Client::GetMixer() const {
  return Call(stubs_->audio, stubs_->server, &v1::AudioService::Stub::GetMixer,
              v1::GetMixerRequest());
}

}  // namespace carillon::client
