// SPDX-License-Identifier: Apache-2.0
//
// The base class of all clients: what a fake does not override, and the calls made of others.
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

absl::StatusOr<v1::GetServerInfoResponse> Client::GetServerInfo() const {
  return NotOverridden("GetServerInfo");
}

absl::StatusOr<bool> Client::IsServing(const std::string&) const {
  return NotOverridden("IsServing");
}

absl::StatusOr<std::string> Client::UploadMesh(absl::string_view) const {
  return NotOverridden("UploadMesh");
}

absl::StatusOr<v1::Job> Client::CreateModalModel(const v1::CreateModalModelRequest&) const {
  return NotOverridden("CreateModalModel");
}

absl::StatusOr<v1::Job> Client::CreateTransfer(const v1::CreateTransferRequest&) const {
  return NotOverridden("CreateTransfer");
}

absl::StatusOr<v1::ModalModelSummary> Client::GetModalModel(const std::string&) const {
  return NotOverridden("GetModalModel");
}

absl::StatusOr<v1::ListModalModelsResponse> Client::ListModalModelsPage(
    const v1::ListModalModelsRequest&) const {
  return NotOverridden("ListModalModelsPage");
}

absl::StatusOr<v1::ModalModelSummary> Client::UpdateModalModel(
    const v1::UpdateModalModelRequest&) const {
  return NotOverridden("UpdateModalModel");
}

absl::Status Client::ExportModalModel(const std::string&, const RecordSink&) const {
  return NotOverridden("ExportModalModel");
}

absl::StatusOr<v1::ModalModelSummary> Client::ImportModalModel(
    const std::function<absl::Status(const RecordSink&)>&, const std::string&,
    const std::string&) const {
  return NotOverridden("ImportModalModel");
}

absl::Status Client::DeleteModalModel(const std::string&) const {
  return NotOverridden("DeleteModalModel");
}

absl::StatusOr<std::vector<v1::CatalogueMaterial>> Client::ListMaterials() const {
  return NotOverridden("ListMaterials");
}

absl::StatusOr<v1::Job> Client::GetJob(const std::string&) const { return NotOverridden("GetJob"); }

absl::StatusOr<v1::ListJobsResponse> Client::ListJobsPage(const v1::ListJobsRequest&) const {
  return NotOverridden("ListJobsPage");
}

absl::StatusOr<v1::Job> Client::CancelJob(const std::string&) const {
  return NotOverridden("CancelJob");
}

absl::StatusOr<v1::Job> Client::WatchJob(const std::string&,
                                         const std::function<void(const v1::Job&)>&) const {
  return NotOverridden("WatchJob");
}

absl::Status Client::WatchJobs(const v1::WatchJobsRequest&,
                               const std::function<bool(const v1::WatchJobsResponse&)>&) const {
  return NotOverridden("WatchJobs");
}

absl::StatusOr<v1::CreateSceneResponse> Client::CreateOrFindScene(
    const v1::CreateSceneRequest&) const {
  return NotOverridden("CreateOrFindScene");
}

absl::StatusOr<v1::Scene> Client::GetScene(const std::string&) const {
  return NotOverridden("GetScene");
}

absl::StatusOr<std::vector<v1::SoundingObject>> Client::AddObjects(
    const v1::AddObjectsRequest&) const {
  return NotOverridden("AddObjects");
}

absl::StatusOr<std::string> Client::CreateScene(const v1::CreateSceneRequest&) const {
  return NotOverridden("CreateScene");
}

absl::StatusOr<v1::Scene> Client::UpdateScene(const v1::UpdateSceneRequest&) const {
  return NotOverridden("UpdateScene");
}

absl::StatusOr<uint32_t> Client::StopAll(const std::string&) const {
  return NotOverridden("StopAll");
}

absl::Status Client::RecordContacts(
    const std::string&, const std::function<void()>&,
    const std::function<bool(const v1::ContactTraceRecord&)>&) const {
  return NotOverridden("RecordContacts");
}

absl::Status Client::ListenTo(const v1::ListenRequest&, const AudioCallback&) const {
  return NotOverridden("ListenTo");
}

absl::StatusOr<v1::UpdateMixerResponse> Client::UpdateMixer(const v1::UpdateMixerRequest&) const {
  return NotOverridden("UpdateMixer");
}

absl::Status Client::DeleteScene(const std::string&) const { return NotOverridden("DeleteScene"); }

absl::StatusOr<std::vector<v1::Scene>> Client::ListScenes() const {
  return NotOverridden("ListScenes");
}

absl::StatusOr<std::vector<v1::SoundingObject>> Client::ListObjects(const std::string&) const {
  return NotOverridden("ListObjects");
}

absl::StatusOr<v1::SoundingObject> Client::AddObject(const v1::AddObjectRequest&) const {
  return NotOverridden("AddObject");
}

absl::StatusOr<v1::SoundingObject> Client::UpdateObject(const v1::UpdateObjectRequest&) const {
  return NotOverridden("UpdateObject");
}

absl::Status Client::RemoveObject(const std::string&) const {
  return NotOverridden("RemoveObject");
}

absl::Status Client::UpdateListener(const v1::UpdateListenerRequest&) const {
  return NotOverridden("UpdateListener");
}

absl::StatusOr<std::unique_ptr<ContactStream>> Client::StreamContacts(
    const v1::ContactStreamStart&) const {
  return NotOverridden("StreamContacts");
}

absl::Status Client::Listen(const AudioCallback&) const { return NotOverridden("Listen"); }

absl::StatusOr<v1::RenderSummary> Client::Render(const v1::RenderSettings&, ContactTraceReader&,
                                                 const AudioCallback&) const {
  return NotOverridden("Render");
}

absl::StatusOr<v1::RenderSummary> Client::Render(
    const v1::RenderSettings&, ContactTraceReader&, const AudioCallback&,
    const std::function<void(const v1::Blow&)>&) const {
  return NotOverridden("Render");
}

absl::StatusOr<v1::GetMixerResponse> Client::GetMixer() const { return NotOverridden("GetMixer"); }

absl::Status Client::FetchMesh(const JobRun&, const std::string&) const {
  return NotOverridden("FetchMesh");
}

absl::Status Client::ReportProgress(const JobRun&, const v1::Progress&) const {
  return NotOverridden("ReportProgress");
}

absl::Status Client::UploadResult(const JobRun&, const v1::RunEnd&, const std::string&) const {
  return NotOverridden("UploadResult");
}

absl::StatusOr<v1::GetDatabaseStatsResponse> Client::GetDatabaseStats() const {
  return NotOverridden("GetDatabaseStats");
}

absl::Status Client::BackUpDatabase(const std::string&) const {
  return NotOverridden("BackUpDatabase");
}

absl::StatusOr<v1::CollectGarbageResponse> Client::CollectGarbage(
    const v1::CollectGarbageRequest&) const {
  return NotOverridden("CollectGarbage");
}

}  // namespace carillon::client
