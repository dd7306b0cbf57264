// SPDX-License-Identifier: Apache-2.0
//
// The base class of all clients: the calls with one answer, each by Client::Call, and the calls
// that only a client of a real daemon has.
#include "carillon/client.h"

#include <google/protobuf/util/delimited_message_util.h>

#include <fstream>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/cpp/internal/grpc_client.h"
#include "client_sdk/cpp/internal/model_file.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

constexpr int kPageSize = 1000;

absl::Status NotOverridden(absl::string_view method) {
  return absl::UnimplementedError(absl::StrCat("this client does not override Client::", method));
}

template <class Request>
Request Named(const std::string& name) {
  Request request;
  request.set_name(name);
  return request;
}

}  // namespace

std::unique_ptr<Client> Connect(const std::string& server, const ConnectOptions& options) {
  return std::make_unique<GrpcClient>(server.empty() ? ReachableServerAddress() : server, options);
}

v1::ErrorInfo ToErrorInfo(const absl::Status& status) { return carillon::ToErrorInfo(status); }

absl::StatusOr<std::vector<v1::ModalModelSummary>> Client::ListModalModels(
    const v1::ListModalModelsRequest& filter) const {
  std::vector<v1::ModalModelSummary> models;
  v1::ListModalModelsRequest request = filter;
  request.clear_page_token();
  request.set_page_size(kPageSize);
  do {
    ASSIGN_OR_RETURN(auto page, ListModalModelsPage(request));
    for (auto& model : *page.mutable_modal_models()) models.push_back(std::move(model));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return models;
}

absl::StatusOr<std::vector<v1::Job>> Client::ListJobs(const v1::ListJobsRequest& filter) const {
  std::vector<v1::Job> jobs;
  v1::ListJobsRequest request = filter;
  request.clear_page_token();
  request.set_page_size(kPageSize);
  do {
    ASSIGN_OR_RETURN(auto page, ListJobsPage(request));
    for (auto& job : *page.mutable_jobs()) jobs.push_back(std::move(job));
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return jobs;
}

absl::Status Client::ExportModalModelFile(const std::string& name, const std::string& file) const {
  std::ofstream out(file, std::ios::binary);
  if (!out) return NotWritable(file);
  absl::Status status = ExportModalModel(name, [&](const v1::ModalModelRecord& record) {
    google::protobuf::util::SerializeDelimitedToOstream(record, &out);
    return out ? absl::OkStatus() : NotWritable(file);
  });
  out.close();
  if (status.ok() && !out) status = NotWritable(file);
  return status;
}

absl::StatusOr<v1::ModalModelSummary> Client::ImportModalModelFile(const std::string& file,
                                                                   const std::string& name,
                                                                   const std::string& label) const {
  return ImportModalModel([&](const RecordSink& sink) { return ReadRecords(file, sink); }, name,
                          label);
}

absl::Status Client::Call(absl::string_view method, const google::protobuf::Message&,
                          google::protobuf::Message&) const {
  // The method of this class has the name of the call.
  return NotOverridden(method.substr(method.find('/') + 1));
}

std::unique_ptr<Client> Client::WithTimeout(std::chrono::milliseconds) const {
  return std::make_unique<Client>();
}

absl::StatusOr<v1::GetServerInfoResponse> Client::GetServerInfo() const {
  v1::GetServerInfoResponse response;
  RETURN_IF_ERROR(Call("ServerService/GetServerInfo", v1::GetServerInfoRequest(), response));
  return response;
}

absl::StatusOr<bool> Client::IsServing(const std::string&) const {
  return NotOverridden("IsServing");
}

absl::StatusOr<std::string> Client::UploadMesh(absl::string_view) const {
  return NotOverridden("UploadMesh");
}

absl::StatusOr<v1::Job> Client::CreateModalModel(const v1::CreateModalModelRequest& request) const {
  v1::CreateModalModelResponse response;
  RETURN_IF_ERROR(Call("ModalModelService/CreateModalModel", request, response));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::Job> Client::CreateTransfer(const v1::CreateTransferRequest& request) const {
  v1::CreateTransferResponse response;
  RETURN_IF_ERROR(Call("ModalModelService/CreateTransfer", request, response));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::ModalModelSummary> Client::GetModalModel(const std::string& name) const {
  v1::GetModalModelResponse response;
  RETURN_IF_ERROR(
      Call("ModalModelService/GetModalModel", Named<v1::GetModalModelRequest>(name), response));
  return std::move(*response.mutable_modal_model());
}

absl::StatusOr<v1::ListModalModelsResponse> Client::ListModalModelsPage(
    const v1::ListModalModelsRequest& request) const {
  v1::ListModalModelsResponse response;
  RETURN_IF_ERROR(Call("ModalModelService/ListModalModels", request, response));
  return response;
}

absl::StatusOr<v1::ModalModelSummary> Client::UpdateModalModel(
    const v1::UpdateModalModelRequest& request) const {
  v1::UpdateModalModelResponse response;
  RETURN_IF_ERROR(Call("ModalModelService/UpdateModalModel", request, response));
  return std::move(*response.mutable_modal_model());
}

absl::Status Client::ExportModalModel(const std::string&, const RecordSink&) const {
  return NotOverridden("ExportModalModel");
}

absl::StatusOr<v1::ModalModelSummary> Client::ImportModalModel(
    const std::function<absl::Status(const RecordSink&)>&, const std::string&,
    const std::string&) const {
  return NotOverridden("ImportModalModel");
}

absl::Status Client::DeleteModalModel(const std::string& name) const {
  v1::DeleteModalModelResponse response;
  return Call("ModalModelService/DeleteModalModel", Named<v1::DeleteModalModelRequest>(name),
              response);
}

absl::StatusOr<std::vector<v1::CatalogueMaterial>> Client::ListMaterials() const {
  v1::ListMaterialsResponse response;
  RETURN_IF_ERROR(Call("ModalModelService/ListMaterials", v1::ListMaterialsRequest(), response));
  return std::vector(response.materials().begin(), response.materials().end());
}

absl::StatusOr<v1::Job> Client::GetJob(const std::string& name) const {
  v1::GetJobResponse response;
  RETURN_IF_ERROR(Call("DecompositionService/GetJob", Named<v1::GetJobRequest>(name), response));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::ListJobsResponse> Client::ListJobsPage(
    const v1::ListJobsRequest& request) const {
  v1::ListJobsResponse response;
  RETURN_IF_ERROR(Call("DecompositionService/ListJobs", request, response));
  return response;
}

absl::StatusOr<v1::Job> Client::CancelJob(const std::string& name) const {
  v1::CancelJobResponse response;
  RETURN_IF_ERROR(
      Call("DecompositionService/CancelJob", Named<v1::CancelJobRequest>(name), response));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::Job> Client::WithdrawFromJob(const std::string& name) const {
  auto request = Named<v1::CancelJobRequest>(name);
  request.set_only_for_caller(true);
  v1::CancelJobResponse response;
  RETURN_IF_ERROR(Call("DecompositionService/CancelJob", request, response));
  return std::move(*response.mutable_job());
}

absl::StatusOr<v1::Job> Client::WatchJob(const std::string&,
                                         const std::function<void(const v1::Job&)>&) const {
  return NotOverridden("WatchJob");
}

absl::Status Client::WatchJobs(const v1::WatchJobsRequest&,
                               const std::function<bool(const v1::WatchJobsResponse&)>&) const {
  return NotOverridden("WatchJobs");
}

absl::StatusOr<v1::CreateSceneResponse> Client::CreateScene(
    const v1::CreateSceneRequest& request) const {
  v1::CreateSceneResponse response;
  RETURN_IF_ERROR(Call("SceneService/CreateScene", request, response));
  return response;
}

absl::StatusOr<v1::Scene> Client::GetScene(const std::string& name) const {
  v1::GetSceneResponse response;
  RETURN_IF_ERROR(Call("SceneService/GetScene", Named<v1::GetSceneRequest>(name), response));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<v1::Scene> Client::UpdateScene(const v1::UpdateSceneRequest& request) const {
  v1::UpdateSceneResponse response;
  RETURN_IF_ERROR(Call("SceneService/UpdateScene", request, response));
  return std::move(*response.mutable_scene());
}

absl::StatusOr<uint32_t> Client::StopAll(const std::string& scene) const {
  v1::StopAllRequest request;
  request.set_scene(scene);
  v1::StopAllResponse response;
  RETURN_IF_ERROR(Call("SceneService/StopAll", request, response));
  return response.scene_count();
}

absl::Status Client::DeleteScene(const std::string& name) const {
  v1::DeleteSceneResponse response;
  return Call("SceneService/DeleteScene", Named<v1::DeleteSceneRequest>(name), response);
}

absl::StatusOr<std::vector<v1::Scene>> Client::ListScenes() const {
  v1::ListScenesResponse response;
  RETURN_IF_ERROR(Call("SceneService/ListScenes", v1::ListScenesRequest(), response));
  return std::vector(response.scenes().begin(), response.scenes().end());
}

absl::StatusOr<std::vector<v1::SoundingObject>> Client::ListObjects(
    const std::string& scene) const {
  v1::ListObjectsRequest request;
  request.set_scene(scene);
  v1::ListObjectsResponse response;
  RETURN_IF_ERROR(Call("SceneService/ListObjects", request, response));
  return std::vector(response.objects().begin(), response.objects().end());
}

absl::StatusOr<std::vector<v1::SoundingObject>> Client::AddObjects(
    const v1::AddObjectsRequest& request) const {
  v1::AddObjectsResponse response;
  RETURN_IF_ERROR(Call("SceneService/AddObjects", request, response));
  return std::vector(response.objects().begin(), response.objects().end());
}

absl::StatusOr<v1::SoundingObject> Client::UpdateObject(
    const v1::UpdateObjectRequest& request) const {
  v1::UpdateObjectResponse response;
  RETURN_IF_ERROR(Call("SceneService/UpdateObject", request, response));
  return std::move(*response.mutable_object());
}

absl::Status Client::RemoveObject(const std::string& name) const {
  v1::RemoveObjectResponse response;
  return Call("SceneService/RemoveObject", Named<v1::RemoveObjectRequest>(name), response);
}

absl::Status Client::UpdateListener(const v1::UpdateListenerRequest& request) const {
  v1::UpdateListenerResponse response;
  return Call("SceneService/UpdateListener", request, response);
}

absl::StatusOr<std::unique_ptr<ContactStream>> Client::StreamContacts(
    const v1::ContactStreamStart&) const {
  return NotOverridden("StreamContacts");
}

absl::Status Client::RecordContacts(
    const std::string&, const std::function<void()>&,
    const std::function<bool(const v1::ContactTraceRecord&)>&) const {
  return NotOverridden("RecordContacts");
}

absl::Status Client::Listen(const v1::ListenRequest&, const AudioCallback&) const {
  return NotOverridden("Listen");
}

absl::StatusOr<v1::RenderSummary> Client::Render(
    const v1::RenderSettings&, ContactTraceReader&, const AudioCallback&,
    const std::function<void(const v1::Blow&)>&) const {
  return NotOverridden("Render");
}

absl::StatusOr<std::unique_ptr<Performance>> Client::Perform(const v1::PerformSettings&) const {
  return NotOverridden("Perform");
}

absl::StatusOr<v1::GetMixerResponse> Client::GetMixer() const {
  v1::GetMixerResponse response;
  RETURN_IF_ERROR(Call("AudioService/GetMixer", v1::GetMixerRequest(), response));
  return response;
}

absl::StatusOr<v1::UpdateMixerResponse> Client::UpdateMixer(
    const v1::UpdateMixerRequest& request) const {
  v1::UpdateMixerResponse response;
  RETURN_IF_ERROR(Call("AudioService/UpdateMixer", request, response));
  return response;
}

absl::StatusOr<v1::GetDatabaseStatsResponse> Client::GetDatabaseStats() const {
  v1::GetDatabaseStatsResponse response;
  RETURN_IF_ERROR(Call("AdminService/GetDatabaseStats", v1::GetDatabaseStatsRequest(), response));
  return response;
}

absl::Status Client::BackUpDatabase(const std::string&) const {
  return NotOverridden("BackUpDatabase");
}

absl::StatusOr<v1::CollectGarbageResponse> Client::CollectGarbage(
    const v1::CollectGarbageRequest& request) const {
  v1::CollectGarbageResponse response;
  RETURN_IF_ERROR(Call("AdminService/CollectGarbage", request, response));
  return response;
}

}  // namespace carillon::client
