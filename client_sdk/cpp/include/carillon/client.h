// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "carillon/audio.h"
#include "carillon/contact_stream.h"
#include "carillon/contact_trace.h"
#include "carillon/v1/admin_service.pb.h"
#include "carillon/v1/audio_service.pb.h"
#include "carillon/v1/contact_service.pb.h"
#include "carillon/v1/decomposition_service.pb.h"
#include "carillon/v1/job_run_service.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "carillon/v1/scene_service.pb.h"

namespace carillon::client {

/// One run of a job on a machine of a cluster: what JobRunService asks for.
struct JobRun {
  std::string job;  ///< "jobs/{digest}"
  std::string token;
};

/// The daemon, seen from outside: its calls, as proto/carillon/v1/*_service.proto describes them.
///
/// Every error is a refusal "REASON: message" with its figures (proto/cpp/error_reason.h takes it
/// apart): those the daemon gives, and SERVER_UNAVAILABLE where none answers. Every method may be
/// called from every thread.
class Client {
 public:
  /// `server` is "unix:PATH" or "HOST:PORT". Connects at the first call, and again when the daemon
  /// comes back. `tls_roots_pem`: certificates that vouch for a daemon with TLS; empty: without
  /// TLS.
  explicit Client(const std::string& server, const std::string& tls_roots_pem = "");
  Client(Client&&) noexcept;
  Client& operator=(Client&&) noexcept;
  ~Client();

  /// Stores a mesh file; returns its digest for CreateModalModel.
  absl::StatusOr<std::string> UploadMesh(absl::string_view bytes) const;
  absl::StatusOr<v1::Job> CreateModalModel(const v1::CreateModalModelRequest& request) const;
  absl::StatusOr<v1::ModalModelSummary> GetModalModel(const std::string& name) const;
  /// Newest first, without their eigenvalues: all, or those that match `filter`, whose page is
  /// ignored.
  absl::StatusOr<std::vector<v1::ModalModelSummary>> ListModalModels(
      const v1::ListModalModelsRequest& filter = {}) const;
  /// One page of them, and the token of the next.
  absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest& request) const;
  absl::StatusOr<v1::ModalModelSummary> UpdateModalModel(
      const v1::UpdateModalModelRequest& request) const;
  /// Takes the records of a model's stored form, one by one; its error ends the transfer.
  using RecordSink = std::function<absl::Status(const v1::ModalModelRecord&)>;
  /// Hands the records of a model to `sink`, whose error is returned.
  absl::Status ExportModalModel(const std::string& name, const RecordSink& sink) const;
  /// Stores the model whose records `send` gives to the sink that it gets; an error of `send` is
  /// returned, and nothing stored. `name`: as below.
  absl::StatusOr<v1::ModalModelSummary> ImportModalModel(
      const std::function<absl::Status(const RecordSink&)>& send, const std::string& name,
      const std::string& label) const;
  /// Writes a model to a file in the stored form. Errors also: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status ExportModalModel(const std::string& name, const std::string& file) const;
  /// Stores the model of a file in the stored form. `name`: "modalModels/{digest}", or empty: named
  /// after its content. Errors also: NotFound (FILE_NOT_FOUND), InvalidArgument
  /// (MODAL_MODEL_MALFORMED).
  absl::StatusOr<v1::ModalModelSummary> ImportModalModel(const std::string& file,
                                                         const std::string& name,
                                                         const std::string& label) const;
  absl::Status DeleteModalModel(const std::string& name) const;
  absl::StatusOr<std::vector<v1::CatalogueMaterial>> ListMaterials() const;

  absl::StatusOr<v1::Job> GetJob(const std::string& name) const;
  /// All of them, newest first.
  absl::StatusOr<std::vector<v1::Job>> ListJobs() const;
  absl::StatusOr<v1::Job> CancelJob(const std::string& name) const;
  /// Follows a job to its end. `on_change`, if any, gets its state at once and after every change.
  /// Returns the job once it has succeeded; where it failed, its error; CANCELLED (JOB_CANCELLED).
  absl::StatusOr<v1::Job> WatchJob(const std::string& name,
                                   const std::function<void(const v1::Job&)>& on_change) const;

  /// Returns "scenes/{id}".
  absl::StatusOr<std::string> CreateScene(const v1::CreateSceneRequest& request = {}) const;
  absl::Status DeleteScene(const std::string& name) const;
  absl::StatusOr<v1::SoundingObject> AddObject(const v1::AddObjectRequest& request) const;
  absl::StatusOr<v1::SoundingObject> UpdateObject(const v1::UpdateObjectRequest& request) const;
  absl::Status RemoveObject(const std::string& name) const;
  absl::Status UpdateListener(const v1::UpdateListenerRequest& request) const;

  /// Opens a contact stream and waits for the daemon's first answer.
  absl::StatusOr<std::unique_ptr<ContactStream>> StreamContacts(
      const v1::ContactStreamStart& start) const;

  /// Hears what the mixer renders until `on_block` returns false (then OK) or the daemon ends it.
  absl::Status Listen(const AudioCallback& on_block) const;
  /// Renders what `trace` still holds, as fast as the daemon can. `on_block` returning false:
  /// CANCELLED (RENDERING_STOPPED).
  absl::StatusOr<v1::RenderSummary> Render(const v1::RenderSettings& settings,
                                           ContactTraceReader& trace,
                                           const AudioCallback& on_block) const;
  absl::StatusOr<v1::GetMixerResponse> GetMixer() const;

  /// Begins a run and writes its mesh to a file. Errors also: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status FetchMesh(const JobRun& run, const std::string& file) const;
  absl::Status ReportProgress(const JobRun& run, const v1::Progress& progress) const;
  /// Ends a run: with the model of a file in the stored form, unless `model_file` is empty. Errors
  /// also: NotFound (FILE_NOT_FOUND), InvalidArgument (MODAL_MODEL_MALFORMED).
  absl::Status UploadResult(const JobRun& run, const v1::RunEnd& end,
                            const std::string& model_file) const;

  /// What the calls of an administrator show over TCP; a Unix socket needs none.
  void SetAdminToken(const std::string& token);
  absl::StatusOr<v1::GetDatabaseStatsResponse> GetDatabaseStats() const;
  /// Writes a copy of the daemon's database to a file. Errors also: Internal (OUTPUT_NOT_WRITABLE).
  absl::Status BackUpDatabase(const std::string& file) const;
  absl::StatusOr<v1::CollectGarbageResponse> CollectGarbage(uint64_t budget_bytes) const;

 private:
  struct Stubs;
  std::unique_ptr<Stubs> stubs_;
};

}  // namespace carillon::client
