// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

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

  /// Stores SmallModel and returns its name.
  std::string ImportSmallModel() { return ImportModel(*SmallModel()); }

  /// Stores a model under its digest, if it has one, and returns its name.
  std::string ImportModel(const ModalModel& model) {
    // Under a sanitizer this takes longer than a client may be silent.
    const auto records = SampleRecords(model);
    grpc::ClientContext context;
    v1::ImportModalModelResponse response;
    const auto writer = models->ImportModalModel(&context, &response);
    v1::ImportModalModelRequest request;
    if (!model.digest.empty()) request.set_name("modalModels/" + model.digest);
    request.set_label("small");
    for (const v1::ModalModelRecord& record : records) {
      *request.mutable_record() = record;
      writer->Write(request);
    }
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
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
  /// Sets whether the program that computes decompositions is there.
  void SetCanDecompose(bool can) { rooms_.can_decompose = can; }

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
