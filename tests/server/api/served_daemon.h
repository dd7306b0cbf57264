// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "carillon/v1/audio_service.grpc.pb.h"
#include "carillon/v1/contact_service.grpc.pb.h"
#include "carillon/v1/decomposition_service.grpc.pb.h"
#include "carillon/v1/error.pb.h"
#include "carillon/v1/modal_model_service.grpc.pb.h"
#include "carillon/v1/scene_service.grpc.pb.h"
#include "carillon/v1/server_service.grpc.pb.h"
#include "server/api/api_server.h"
#include "server/live_output/live_output.h"
#include "tests/server/api/daemon_rooms.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/scene/small_model.h"

namespace carillon {

/// A daemon as DaemonRooms, and clients of it.
class ServedDaemon : public testing::Test {
 protected:
  /// Of `settings`, the addresses and the version are set here; `more` are further addresses.
  explicit ServedDaemon(ApiSettings settings = {.client_share = 1},
                        const std::vector<std::string>& more = {}) {
    rooms_.Serve(std::move(settings), more);
    channel_ = grpc::CreateChannel(rooms_.address, grpc::InsecureChannelCredentials());
    models = v1::ModalModelService::NewStub(channel_);
    jobs = v1::DecompositionService::NewStub(channel_);
    scenes = v1::SceneService::NewStub(channel_);
    contacts = v1::ContactService::NewStub(channel_);
    audio = v1::AudioService::NewStub(channel_);
    info = v1::ServerService::NewStub(channel_);
  }

  /// Calls a method with one request and one response; the response stays in `response`.
  template <typename Stub, typename Request, typename Response>
  static grpc::Status Call(Stub& stub,
                           grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                        Response*),
                           const Request& request, Response& response) {
    grpc::ClientContext context;
    return (stub.*method)(&context, request, &response);
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
    v1::CreateModalModelResponse response;
    EXPECT_TRUE(
        Call(*models, &v1::ModalModelService::Stub::CreateModalModel, request, response).ok());
    return response.job();
  }
  v1::Job Submit(const std::string& label) {
    return Submit(RequestFor("the mesh of " + label, label));
  }

  /// Imports a model under a name, or under one that the daemon gives, with the label "small".
  static grpc::Status Import(v1::ModalModelService::Stub& stub, const std::string& name,
                             const std::vector<v1::ModalModelRecord>& records,
                             v1::ImportModalModelResponse& response) {
    grpc::ClientContext context;
    const auto writer = stub.ImportModalModel(&context, &response);
    v1::ImportModalModelRequest request;
    request.set_name(name);
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

  /// Stores a model under its digest, if it has one, and returns its name.
  std::string ImportModel(const ModalModel& model) {
    v1::ImportModalModelResponse response;
    const grpc::Status status =
        Import(*models, model.digest.empty() ? "" : "modalModels/" + model.digest,
               SampleRecords(model), response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.modal_model().name();
  }

  std::string CreateScene() {
    grpc::ClientContext context;
    v1::CreateSceneResponse response;
    EXPECT_TRUE(scenes->CreateScene(&context, {}, &response).ok());
    return response.name();
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

  grpc::Status Add(const v1::AddObjectsRequest& request, v1::AddObjectsResponse& response) {
    grpc::ClientContext context;
    return scenes->AddObjects(&context, request, &response);
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

  /// Strikes object 1 of a scene live; returns the last answer.
  v1::StreamContactsResponse StrikeLive(const std::string& scene,
                                        std::optional<double> scheduling_delay_s = {}) {
    grpc::ClientContext context;
    const auto stream = contacts->StreamContacts(&context);
    v1::StreamContactsRequest request;
    request.mutable_start()->set_scene(scene);
    request.mutable_start()->set_step_s(0.01);
    if (scheduling_delay_s) {
      request.mutable_start()->set_scheduling_delay_s(*scheduling_delay_s);
    }
    stream->Write(request);
    request.Clear();
    *request.add_steps()->add_contacts() = Strike(1);
    stream->Write(request);
    stream->WritesDone();
    v1::StreamContactsResponse answer;
    while (stream->Read(&answer)) {
    }
    EXPECT_TRUE(stream->Finish().ok());
    return answer;
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

  std::unique_ptr<v1::ModalModelService::Stub> models;
  std::unique_ptr<v1::DecompositionService::Stub> jobs;
  std::unique_ptr<v1::SceneService::Stub> scenes;
  std::unique_ptr<v1::ContactService::Stub> contacts;
  std::unique_ptr<v1::AudioService::Stub> audio;
  std::unique_ptr<v1::ServerService::Stub> info;
  std::shared_ptr<grpc::Channel> channel() { return channel_; }
  LiveOutput& output() { return *rooms_.output; }
  std::filesystem::path folder() const { return rooms_.folder / ""; }
  const std::string& address() const { return rooms_.address; }
  const std::vector<std::string>& addresses() const { return rooms_.server->addresses(); }
  const ApiServer& server() const { return *rooms_.server; }
  /// The warnings so far, a line each.
  std::string log() {
    const MutexLock lock(&rooms_.log_mutex);
    return rooms_.log;
  }
  /// The lines of the events so far.
  std::vector<std::string> events() {
    const MutexLock lock(&rooms_.log_mutex);
    return rooms_.events;
  }

 private:
  DaemonRooms rooms_;
  std::shared_ptr<grpc::Channel> channel_;
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
