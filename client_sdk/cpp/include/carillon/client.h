// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/message.h>

#include <chrono>
#include <cstdint>
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
#include "carillon/performance.h"
#include "carillon/v1/admin_service.pb.h"
#include "carillon/v1/audio_service.pb.h"
#include "carillon/v1/contact_service.pb.h"
#include "carillon/v1/decomposition_service.pb.h"
#include "carillon/v1/error.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "carillon/v1/scene_service.pb.h"
#include "carillon/v1/server_service.pb.h"

namespace carillon::client {

/// The calls of a Carillon daemon. The files proto/carillon/v1/*_service.proto, which are installed
/// with this header, describe each call, its limits and the units of its fields.
///
/// Connect() makes a client of a real daemon. Code that takes a `const Client&` can be tested
/// without one: derive a fake or a gmock class from Client and override the calls that the test
/// needs, or Call() for many of them. The base class answers every other call with UNIMPLEMENTED.
///
/// Errors: a failed call returns a status whose message is "REASON: text for people"; ToErrorInfo()
/// takes it apart. proto/errors.md lists the reasons that the daemon gives. In addition, every call
/// can return UNAVAILABLE (SERVER_UNAVAILABLE) if no daemon answers, and DEADLINE_EXCEEDED
/// (SERVER_TIMEOUT) after the time that WithTimeout() was given. Without it, a call that transfers
/// no stream and no file gives up after 60 seconds, and other calls never.
///
/// Threads: any number of threads may call the methods of one client at the same time. A call
/// blocks its thread until the daemon has answered. Callbacks run on the calling thread. A call
/// that streams sound, contacts or jobs refuses an empty callback with INVALID_ARGUMENT
/// (INVALID_SETTINGS), unless the callback may be null.
class Client {
 public:
  virtual ~Client() = default;

  /// Receives the records of a stored modal model in order. An error that it returns ends the
  /// transfer.
  using RecordSink = std::function<absl::Status(const v1::ModalModelRecord&)>;

  /// Returns a client of the same connection each of whose calls ends after `timeout` with
  /// DEADLINE_EXCEEDED (SERVER_TIMEOUT) if it has not ended before. A contact stream that this
  /// client opens ends then, too. This client need not outlive the other one.
  virtual std::unique_ptr<Client> WithTimeout(std::chrono::milliseconds timeout) const;

  // The daemon.

  /// Returns the version, the age, the limits and the features of the daemon. Needs no token.
  virtual absl::StatusOr<v1::GetServerInfoResponse> GetServerInfo() const;

  /// Returns whether a service, such as "carillon.v1.AudioService", is SERVING after the daemon's
  /// health (grpc.health.v1); docs/troubleshoot.md has the services and what keeps each from
  /// serving. The empty name is the whole daemon. Needs no token. Returns DEADLINE_EXCEEDED
  /// (SERVER_TIMEOUT) after 10 seconds.
  virtual absl::StatusOr<bool> IsServing(const std::string& service) const;

  // Modal models.

  /// Stores the bytes of a mesh file and returns their digest, which CreateModalModel takes.
  virtual absl::StatusOr<std::string> UploadMesh(absl::string_view bytes) const;

  /// Asks for the decomposition of a stored mesh and returns the job at once; WatchJob waits for
  /// its end. The same request again returns the same job while that job waits or runs, or if its
  /// model is stored, or if it would fail again; otherwise the daemon computes it anew.
  virtual absl::StatusOr<v1::Job> CreateModalModel(
      const v1::CreateModalModelRequest& request) const;

  /// Asks how the modes of a stored model radiate from a body of some material, and returns the job
  /// at once.
  virtual absl::StatusOr<v1::Job> CreateTransfer(const v1::CreateTransferRequest& request) const;

  /// Returns the stored model "modalModels/{digest}" with its eigenvalues.
  virtual absl::StatusOr<v1::ModalModelSummary> GetModalModel(const std::string& name) const;

  /// Returns one page of the stored models, newest first, and the token of the next page. The
  /// summaries have no eigenvalues.
  virtual absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest& request) const;

  /// Returns all stored models that match `filter`, newest first, by calling ListModalModelsPage
  /// for each page. The page size and the page token of `filter` are ignored.
  absl::StatusOr<std::vector<v1::ModalModelSummary>> ListModalModels(
      const v1::ListModalModelsRequest& filter = {}) const;

  /// Changes the label, the tags, the pin or the material of a model.
  virtual absl::StatusOr<v1::ModalModelSummary> UpdateModalModel(
      const v1::UpdateModalModelRequest& request) const;

  /// Passes the records of a stored model and its transfers to `sink`, and returns the error of
  /// `sink` if there is one.
  virtual absl::Status ExportModalModel(const std::string& name, const RecordSink& sink) const;

  /// Writes a stored model to a file that ImportModalModelFile reads.
  /// Further errors: INTERNAL (OUTPUT_NOT_WRITABLE).
  absl::Status ExportModalModelFile(const std::string& name, const std::string& file) const;

  /// Stores the model whose records `send` passes to the sink that it is given. If `send` returns
  /// an error, this error is returned and nothing is stored. `name` is "modalModels/{digest}"; if
  /// it is empty, the daemon names the model after its content. Further errors: ALREADY_EXISTS
  /// (MODAL_MODEL_EXISTS: another model has that name, see ModalModelService.ImportModalModel).
  virtual absl::StatusOr<v1::ModalModelSummary> ImportModalModel(
      const std::function<absl::Status(const RecordSink&)>& send, const std::string& name,
      const std::string& label) const;

  /// Stores the model of a file that ExportModalModelFile or carillon-precompute wrote; `name` and
  /// `label` are those of ImportModalModel.
  /// Further errors: NOT_FOUND (FILE_NOT_FOUND), INVALID_ARGUMENT (MODAL_MODEL_MALFORMED).
  absl::StatusOr<v1::ModalModelSummary> ImportModalModelFile(const std::string& file,
                                                             const std::string& name,
                                                             const std::string& label) const;

  /// Deletes a stored model and its job. Objects that sound with the model keep it.
  virtual absl::Status DeleteModalModel(const std::string& name) const;

  /// Returns the named materials that a v1::Material can refer to.
  virtual absl::StatusOr<std::vector<v1::CatalogueMaterial>> ListMaterials() const;

  // Decomposition jobs.

  /// Returns the job "jobs/{digest}".
  virtual absl::StatusOr<v1::Job> GetJob(const std::string& name) const;

  /// Returns one page of the jobs, newest first, and the token of the next page.
  virtual absl::StatusOr<v1::ListJobsResponse> ListJobsPage(
      const v1::ListJobsRequest& request) const;

  /// Returns all jobs that match `filter`, newest first, by calling ListJobsPage for each page. The
  /// page size and the page token of `filter` are ignored.
  absl::StatusOr<std::vector<v1::Job>> ListJobs(const v1::ListJobsRequest& filter = {}) const;

  /// Cancels a job that has not ended. The job goes on as long as other clients want it that have
  /// asked for it, too. Further errors: PERMISSION_DENIED (JOB_OF_ANOTHER).
  virtual absl::StatusOr<v1::Job> CancelJob(const std::string& name) const;

  /// Does the same for this client alone: a client with the role administer, as those of a Unix
  /// socket have, does not cancel the job for the others, either.
  virtual absl::StatusOr<v1::Job> WithdrawFromJob(const std::string& name) const;

  /// Waits until a job ends and returns it if it has succeeded; if it has failed, returns the
  /// error of the decomposition. `on_change` may be null; otherwise it receives the job at once
  /// and after every change.
  /// Further errors: CANCELLED (JOB_CANCELLED).
  virtual absl::StatusOr<v1::Job> WatchJob(
      const std::string& name, const std::function<void(const v1::Job&)>& on_change) const;

  /// Passes the jobs that wait or run to `on_answer`, then an answer without a job, then each job
  /// that matches after every change, until `on_answer` returns false; then returns OK.
  virtual absl::Status WatchJobs(
      const v1::WatchJobsRequest& request,
      const std::function<bool(const v1::WatchJobsResponse&)>& on_answer) const;

  // Scenes and their sounding objects.

  /// Creates a scene, or finds the scene that has the id of the request. Returns its name,
  /// "scenes/{id}", and whether it was there before. A request without an id always makes a new
  /// scene.
  virtual absl::StatusOr<v1::CreateSceneResponse> CreateScene(
      const v1::CreateSceneRequest& request = {}) const;

  /// Returns the scene "scenes/{id}".
  virtual absl::StatusOr<v1::Scene> GetScene(const std::string& name) const;

  /// Changes the gain of a scene, mutes it, or lets it sound alone, and returns it.
  virtual absl::StatusOr<v1::Scene> UpdateScene(const v1::UpdateSceneRequest& request) const;

  /// Fades out all objects of a scene within 30 ms or, if `scene` is empty, those of all scenes of
  /// the caller. Returns the number of scenes.
  virtual absl::StatusOr<uint32_t> StopAll(const std::string& scene = "") const;

  /// Fades out the objects of a scene and deletes it. A scene that was not made with `keep` ends by
  /// itself a minute after the connections that have used it.
  virtual absl::Status DeleteScene(const std::string& name) const;

  /// Returns the scenes of the caller, the oldest first: all of the daemon if it has no access
  /// file, or if the caller is an administrator.
  virtual absl::StatusOr<std::vector<v1::Scene>> ListScenes() const;

  /// Returns the objects of a scene by their handles.
  virtual absl::StatusOr<std::vector<v1::SoundingObject>> ListObjects(
      const std::string& scene) const;

  /// Adds objects that sound with stored models to a scene, all of them or none, and returns them
  /// in the order of the request. Contacts refer to an object by its handle, which the caller may
  /// choose. The figure "index" of an error is the place of the object that was refused.
  virtual absl::StatusOr<std::vector<v1::SoundingObject>> AddObjects(
      const v1::AddObjectsRequest& request) const;

  /// Changes the material, the size, the gain or the pose of an object while it sounds.
  virtual absl::StatusOr<v1::SoundingObject> UpdateObject(
      const v1::UpdateObjectRequest& request) const;

  /// Fades out the object "scenes/{id}/objects/{handle}" and removes it from its scene.
  virtual absl::Status RemoveObject(const std::string& name) const;

  /// Moves the listener of a scene.
  virtual absl::Status UpdateListener(const v1::UpdateListenerRequest& request) const;

  /// Opens a contact stream to a scene and waits for the daemon's first answer.
  virtual absl::StatusOr<std::unique_ptr<ContactStream>> StreamContacts(
      const v1::ContactStreamStart& start) const;

  /// Passes the records of the next contact stream that begins in a scene to `on_record`: a header,
  /// then objects and steps, until that stream ends or `on_record` returns false. `on_begun`, which
  /// may be null, is called once the recording waits for the stream.
  virtual absl::Status RecordContacts(
      const std::string& scene, const std::function<void()>& on_begun,
      const std::function<bool(const v1::ContactTraceRecord&)>& on_record) const;

  // Sound.

  /// Passes the sound that `request` asks for, of the output or of one scene, to `on_block` until
  /// `on_block` returns false or the scene is deleted; then returns OK. Samples come as floats,
  /// whatever their encoding on the wire is.
  virtual absl::Status Listen(const v1::ListenRequest& request,
                              const AudioCallback& on_block) const;

  /// Renders the rest of `trace` offline, as fast as the daemon can, and passes the sound to
  /// `on_block`. After the sound, passes each impulse that sounded to `on_blow`, unless it is null,
  /// if `settings.tell_blows()` is true. A reader is at its end after a rendering. Further errors:
  /// those of ContactTraceReader::Next; INVALID_ARGUMENT (TRACE_EMPTY) if nothing of `trace` is
  /// left; CANCELLED (RENDERING_STOPPED) if `on_block` returned false.
  virtual absl::StatusOr<v1::RenderSummary> Render(
      const v1::RenderSettings& settings, ContactTraceReader& trace, const AudioCallback& on_block,
      const std::function<void(const v1::Blow&)>& on_blow = nullptr) const;

  /// Begins environments whose sound comes in step with their simulation, and waits for the
  /// daemon's answer to `settings`.
  virtual absl::StatusOr<std::unique_ptr<Performance>> Perform(
      const v1::PerformSettings& settings) const;

  /// Returns the state of the mixer and the audio device.
  virtual absl::StatusOr<v1::GetMixerResponse> GetMixer() const;

  /// Changes the gain of the output or mutes it. Over TCP this needs the role "administer".
  virtual absl::StatusOr<v1::UpdateMixerResponse> UpdateMixer(
      const v1::UpdateMixerRequest& request) const;

  // Administration; over TCP these calls need the role "administer".

  /// Returns the size and the contents of the daemon's database.
  virtual absl::StatusOr<v1::GetDatabaseStatsResponse> GetDatabaseStats() const;

  /// Writes a consistent copy of the daemon's database to a file. A file that has the name already
  /// is replaced once the copy is complete; after an error it stays as it was.
  /// Further errors: INTERNAL (OUTPUT_NOT_WRITABLE), FAILED_PRECONDITION
  /// (OUTPUT_NOT_WRITABLE, too, if the file belongs to the database of a daemon), DATA_LOSS.
  virtual absl::Status BackUpDatabase(const std::string& file) const;

  /// Deletes the models that sounded least recently until the others fit into the request's budget.
  /// Further errors: INVALID_ARGUMENT (INVALID_SETTINGS).
  virtual absl::StatusOr<v1::CollectGarbageResponse> CollectGarbage(
      const v1::CollectGarbageRequest& request) const;

 protected:
  /// Makes a call with one request and one answer; all methods for such calls use it. `method` is
  /// the name of the call in the contract, for example "SceneService/GetScene".
  virtual absl::Status Call(absl::string_view method, const google::protobuf::Message& request,
                            google::protobuf::Message& response) const;
};

/// What Connect() may need beyond an address.
struct ConnectOptions {
  /// PEM certificates of the authorities that vouch for a daemon with TLS. If it is empty, the
  /// connection is not encrypted.
  std::string tls_roots_pem;
  /// The PEM certificate by which the daemon knows this client, and its private key. Both may be
  /// empty.
  std::string tls_certificate_pem;
  std::string tls_key_pem;
  /// The token by which the daemon knows this client over TCP. If it is empty, $CARILLON_TOKEN is
  /// taken. Without TLS a token is sent to this machine's own addresses only: unix:PATH, localhost,
  /// 127.0.0.0/8 and [::1]. Calls of any other address fail with TLS_REQUIRED.
  std::string token;
};

/// Returns a client of the daemon at `server`: "unix:PATH" or "HOST:PORT". If `server` is empty,
/// the address is $CARILLON_SERVER or, without that variable, the Unix socket on which the daemon
/// listens by default. Returns at once: the connection is made by the first call, and made again
/// after the daemon has been restarted.
std::unique_ptr<Client> Connect(const std::string& server = "", const ConnectOptions& options = {});

/// Returns the reason, the text and the figures of an error that this library has returned; the
/// reason of any other error is "INTERNAL".
v1::ErrorInfo ToErrorInfo(const absl::Status& status);

}  // namespace carillon::client
