// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "carillon/v1/audio_service.grpc.pb.h"
#include "carillon/v1/contact_service.grpc.pb.h"
#include "carillon/v1/decomposition_service.grpc.pb.h"
#include "carillon/v1/error.pb.h"
#include "carillon/v1/modal_model_service.grpc.pb.h"
#include "carillon/v1/scene_service.grpc.pb.h"
#include "carillon/v1/server_service.grpc.pb.h"
#include "server/api/api_server.h"
#include "server/base/mutex.h"
#include "server/decomposition/worker/local_executor.h"
#include "server/live_output/live_output.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/scene/small_model.h"

namespace carillon {

inline constexpr auto kInvalid = grpc::StatusCode::INVALID_ARGUMENT;

using AudioStub = v1::AudioService::Stub;
using JobStub = v1::DecompositionService::Stub;
using ModelStub = v1::ModalModelService::Stub;
using SceneStub = v1::SceneService::Stub;

/// A method with one request and one response.
template <typename Stub, typename Request, typename Response>
using Method = grpc::Status (Stub::*)(grpc::ClientContext*, const Request&, Response*);

/// Returns a request of a call that takes a name alone.
template <typename Request>
Request Named(const std::string& name) {
  Request request;
  request.set_name(name);
  return request;
}

/// All rooms of a daemon, on the null device, which serves on a Unix socket, and clients of it. Its
/// decompositions fail: the worker is a program that only exits, or one that only sleeps.
class ServedDaemon : public testing::Test {
 protected:
  /// Of `settings`, the addresses and the version are set here; `more` are further addresses.
  explicit ServedDaemon(ApiSettings settings = {.client_share = 1},
                        const std::vector<std::string>& more = {}, bool worker_sleeps = false)
      : worker_sleeps_(worker_sleeps) {
    settings.addresses = {address_};
    settings.addresses.insert(settings.addresses.end(), more.begin(), more.end());
    settings.version = "test";
    server_ = *ApiServer::Start(settings, {.database = *database_,
                                           .decompositions = *queue_,
                                           .scenes = scene_registry_,
                                           .output = *output_,
                                           .clock = clock_,
                                           .log = [this](const std::string& line) { Note(line); },
                                           .log_event = [this](const Event& event) { Note(event); },
                                           .check_decomposition = [] { return absl::OkStatus(); }});
  }

  /// A connection of its own to one of the daemon's addresses.
  static std::shared_ptr<grpc::Channel> Connect(const std::string& address) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
  }

  /// Calls a method with one request and one response; the response stays in `response`.
  template <typename Stub, typename Request, typename Response>
  static grpc::Status Call(Stub& stub, Method<Stub, Request, Response> method,
                           const std::type_identity_t<Request>& request, Response& response) {
    grpc::ClientContext context;
    return (stub.*method)(&context, request, &response);
  }

  /// The status of such a call.
  template <typename Stub, typename Request, typename Response>
  static grpc::Status Call(Stub& stub, Method<Stub, Request, Response> method,
                           const std::type_identity_t<Request>& request) {
    Response response;
    return Call(stub, method, request, response);
  }

  /// The response to such a call, which must succeed.
  template <typename Stub, typename Request, typename Response>
  static Response Called(Stub& stub, Method<Stub, Request, Response> method,
                         const std::type_identity_t<Request>& request) {
    Response response;
    const grpc::Status status = Call(stub, method, request, response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }

  /// Reads a stream to its end; the last message stays in `last`.
  template <typename Stream, typename Response>
  static grpc::Status ReadToEnd(Stream& stream, Response& last) {
    while (stream.Read(&last)) {
    }
    return stream.Finish();
  }

  /// Stores a mesh file that comes in pieces.
  grpc::Status Upload(const std::vector<std::string>& pieces, v1::UploadMeshResponse& response) {
    grpc::ClientContext context;
    const auto writer = models->UploadMesh(&context, &response);
    for (const std::string& piece : pieces) {
      v1::UploadMeshRequest request;
      request.set_data(piece);
      writer->Write(request);
    }
    writer->WritesDone();
    return writer->Finish();
  }

  /// The request for the model of a mesh, which is stored first. The job fails, since no mesh of
  /// these tests is one.
  v1::CreateModalModelRequest RequestFor(const std::string& mesh, const std::string& label = "") {
    v1::UploadMeshResponse uploaded;
    EXPECT_TRUE(Upload({mesh}, uploaded).ok());
    v1::CreateModalModelRequest request;
    request.set_mesh_digest(uploaded.mesh_digest());
    request.set_mesh_format("obj");
    request.mutable_material()->set_preset("chime_aluminum");
    request.set_label(label);
    return request;
  }

  v1::Job Submit(const v1::CreateModalModelRequest& request) {
    return Called(*models, &ModelStub::CreateModalModel, request).job();
  }
  v1::Job Submit(const std::string& label) {
    return Submit(RequestFor("the mesh of " + label, label));
  }

  /// Imports a model under a name, or under one that the daemon gives, with the label "small".
  static grpc::Status Import(ModelStub& stub, const std::string& name,
                             const std::vector<v1::ModalModelRecord>& records) {
    grpc::ClientContext context;
    v1::ImportModalModelResponse response;
    const auto writer = stub.ImportModalModel(&context, &response);
    auto request = Named<v1::ImportModalModelRequest>(name);
    request.set_label("small");
    for (const v1::ModalModelRecord& record : records) {
      *request.mutable_record() = record;
      writer->Write(request);
    }
    writer->WritesDone();
    return writer->Finish();
  }

  /// Stores SmallModel and returns its name.
  std::string ImportSmallModel() { return ImportModel(*SmallModel()); }

  /// Stores a model under its digest and returns its name.
  std::string ImportModel(const ModalModel& model) {
    std::string name = "modalModels/" + model.digest;
    const grpc::Status status = Import(*models, name, SampleRecords(model));
    EXPECT_TRUE(status.ok()) << status.error_message();
    return name;
  }

  std::string CreateScene() { return Called(*scenes, &SceneStub::CreateScene, {}).name(); }

  /// A scene with one object of SmallModel, whose handle is 1.
  std::string CreateSceneWithObject() {
    std::string scene = CreateScene();
    Called(*scenes, &SceneStub::AddObjects, SmallObject(scene));
    return scene;
  }

  /// What SmallModel is made of.
  static v1::Material SmallMaterial() {
    const ObjectProperties small = SmallProperties();
    v1::Material material;
    material.set_young_pa(small.material.young_pa);
    material.set_density_kg_per_m3(small.material.density_kg_per_m3);
    material.set_alpha1_s(small.material.alpha1_s);
    material.set_alpha2_per_s(small.material.alpha2_per_s);
    return material;
  }

  /// The request for one object of SmallModel.
  v1::AddObjectsRequest SmallObject(const std::string& scene) {
    v1::AddObjectsRequest request;
    request.set_scene(scene);
    v1::NewObject& object = *request.add_objects();
    object.set_modal_model(ImportSmallModel());
    *object.mutable_material() = SmallMaterial();
    return request;
  }

  /// 1 N s along x at the origin of object `handle`.
  static v1::Contact Strike(uint32_t handle) {
    v1::Contact impulse;
    impulse.set_kind(v1::CONTACT_KIND_IMPACT);
    impulse.set_object(handle);
    impulse.mutable_point_m();
    impulse.mutable_impulse_newton_seconds()->set_x(1);
    return impulse;
  }

  /// The first request of a stream of contacts.
  static v1::StreamContactsRequest StreamStart(const std::string& scene) {
    v1::StreamContactsRequest request;
    request.mutable_start()->set_scene(scene);
    request.mutable_start()->set_step_s(0.01);
    return request;
  }

  /// Sends `requests`, then reads to the end; the last answer stays in `last`.
  grpc::Status Exchange(const std::vector<v1::StreamContactsRequest>& requests,
                        v1::StreamContactsResponse& last) {
    grpc::ClientContext context;
    const auto stream = contacts->StreamContacts(&context);
    for (const v1::StreamContactsRequest& request : requests) stream->Write(request);
    stream->WritesDone();
    return ReadToEnd(*stream, last);
  }

  /// Strikes object 1 of a scene live; returns the last answer.
  v1::StreamContactsResponse StrikeLive(const std::string& scene,
                                        std::optional<double> scheduling_delay_s = {}) {
    v1::StreamContactsRequest start = StreamStart(scene), strike;
    if (scheduling_delay_s) start.mutable_start()->set_scheduling_delay_s(*scheduling_delay_s);
    *strike.add_steps()->add_contacts() = Strike(1);
    v1::StreamContactsResponse last;
    EXPECT_TRUE(Exchange({start, strike}, last).ok());
    return last;
  }

  /// The requests of an offline rendering: the settings, a header, one object that is struck, and
  /// the step with the strike at 0.5 s.
  std::vector<v1::RenderRequest> Trace() {
    std::vector<v1::RenderRequest> requests(4);
    requests[0].mutable_settings()->set_tail_s(0.2);
    requests[1].mutable_record()->mutable_header()->set_format_version(1);
    v1::ContactTraceObject& object = *requests[2].mutable_record()->mutable_object();
    object.set_handle(1);
    object.set_modal_model(ImportSmallModel());
    *object.mutable_material() = SmallMaterial();
    v1::ContactStep& step = *requests[3].mutable_record()->mutable_step();
    step.set_time_s(0.5);
    *step.add_contacts() = Strike(1);
    return requests;
  }

  struct Rendering {
    grpc::Status status;
    v1::AudioFormat format;
    std::vector<float> sound;
    v1::RenderSummary summary;
  };

  Rendering Render(const std::vector<v1::RenderRequest>& requests) {
    Rendering rendering;
    grpc::ClientContext context;
    const auto stream = audio->Render(&context);
    for (const v1::RenderRequest& request : requests) stream->Write(request);
    stream->WritesDone();
    v1::RenderResponse response;
    while (stream->Read(&response)) {
      if (response.has_format()) rendering.format = response.format();
      if (response.has_summary()) rendering.summary = response.summary();
      if (response.has_block()) {
        EXPECT_EQ(response.block().first_frame(),
                  rendering.sound.size() / rendering.format.channel_count());
        AppendSamples(response.block(), rendering.sound);
      }
    }
    rendering.status = stream->Finish();
    return rendering;
  }

  static void AppendSamples(const v1::AudioBlock& block, std::vector<float>& sound) {
    const size_t old_size = sound.size();
    sound.resize(old_size + block.samples().size() / sizeof(float));
    std::ranges::copy(block.samples(), reinterpret_cast<char*>(sound.data() + old_size));
  }

  /// The warnings so far, a line each.
  std::string log() {
    const MutexLock lock(&log_mutex_);
    return log_;
  }
  /// The lines of the events so far.
  std::vector<std::string> events() {
    const MutexLock lock(&log_mutex_);
    return events_;
  }

 private:
  std::unique_ptr<DecompositionQueue> MakeQueue() {
    LocalExecutorOptions options;
    options.program = "/bin/false";
    options.directory = folder_ / "work";
    options.worker_count = 1;
    if (worker_sleeps_) {
      options.program = folder_ / "sleeps";
      std::ofstream(options.program) << "#!/bin/sh\nexec sleep 600\n";
      std::filesystem::permissions(options.program, std::filesystem::perms::owner_all);
    }
    return *DecompositionQueue::Make(*database_, *MakeLocalExecutor(options, clock_), clock_,
                                     {.log_event = [this](const Event& event) { Note(event); }});
  }

  void Note(const std::string& line) {
    const MutexLock lock(&log_mutex_);
    log_ += line + "\n";
  }

  void Note(const Event& event) {
    const MutexLock lock(&log_mutex_);
    events_.push_back(event.ToLine());
  }

  Mutex log_mutex_;
  std::string log_;
  std::vector<std::string> events_;

 protected:
  const bool worker_sleeps_;
  TemporaryFolder folder_;
  const std::string address_ = "unix:" + (folder_ / "socket").string();
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_ = *ModeDatabase::Open(folder_ / "carillon.db", clock_);
  std::unique_ptr<DecompositionQueue> queue_ = MakeQueue();
  std::unique_ptr<LiveOutput> output_ =
      *LiveOutput::Start({.device = "null"}, clock_, [](const std::string&) {});
  SceneRegistry scene_registry_{output_->mixer()};
  std::unique_ptr<ApiServer> server_;
  const std::shared_ptr<grpc::Channel> channel_ = Connect(address_);
  const std::unique_ptr<ModelStub> models = v1::ModalModelService::NewStub(channel_);
  const std::unique_ptr<JobStub> jobs = v1::DecompositionService::NewStub(channel_);
  const std::unique_ptr<SceneStub> scenes = v1::SceneService::NewStub(channel_);
  const std::unique_ptr<v1::ContactService::Stub> contacts = v1::ContactService::NewStub(channel_);
  const std::unique_ptr<AudioStub> audio = v1::AudioService::NewStub(channel_);
  const std::unique_ptr<v1::ServerService::Stub> info = v1::ServerService::NewStub(channel_);
};

/// What the trailing metadata of a refused call says.
inline v1::ErrorInfo ErrorOf(const grpc::Status& status) {
  v1::StatusDetails details;
  v1::ErrorInfo error;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  EXPECT_EQ(details.code(), status.error_code());
  EXPECT_EQ(details.message(), status.error_message());
  EXPECT_EQ(details.details_size(), 1);
  if (details.details_size() == 1) {
    EXPECT_TRUE(details.details(0).UnpackTo(&error));
  }
  return error;
}

inline void ExpectRefused(const grpc::Status& status, grpc::StatusCode code, const char* reason) {
  EXPECT_EQ(status.error_code(), code) << status.error_message();
  EXPECT_EQ(ErrorOf(status).reason(), reason);
  EXPECT_NE(ErrorOf(status).message(), "");
}

}  // namespace carillon
