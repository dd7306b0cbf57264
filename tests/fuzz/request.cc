// SPDX-License-Identifier: Apache-2.0
// Sends the input to a daemon in this process: the first line names a method of the contract, the
// rest is its requests in protobuf's delimited form. The daemon has one small model,
// "modalModels/aaa...", and one scene, "scenes/fuzz", with one object of it. A call must end in
// time, and never as a defect.
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "carillon/v1/modal_model_service.grpc.pb.h"
#include "carillon/v1/scene_service.grpc.pb.h"
#include "tests/fuzz/request_case.h"
#include "tests/server/api/daemon_rooms.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

using Deadline = std::chrono::system_clock::time_point;

Deadline In(std::chrono::milliseconds time) { return std::chrono::system_clock::now() + time; }

/// Beyond it a call counts as hanging.
constexpr std::chrono::seconds kLimit(15);
/// For calls that last until the client ends them.
constexpr std::chrono::milliseconds kLasting(4);
/// A rendering or an export may be long; its client goes away after these answers.
constexpr int kMostAnswers = 20;

bool Lasts(const std::string& method) {
  for (const char* name : {"/Listen", "/WatchJob", "/WatchJobs", "/RecordContacts"}) {
    if (absl::EndsWith(method, name)) return true;
  }
  return false;
}

/// One call with messages that need not be of the right type.
class RawCall {
 public:
  RawCall(const std::shared_ptr<grpc::Channel>& channel, const std::string& method)
      : stub_(channel), lasts_(Lasts(method)) {
    context_.set_deadline(lasts_ ? In(kLasting) : In(kLimit));
    call_ = stub_.PrepareCall(&context_, "/" + method, &queue_);
    call_->StartCall(this);
    open_ = Done();
  }
  RawCall(const RawCall&) = delete;
  RawCall& operator=(const RawCall&) = delete;
  ~RawCall() { queue_.Shutdown(); }

  void Write(const std::string& message) {
    if (!open_) return;
    const grpc::Slice slice(message);
    call_->Write(grpc::ByteBuffer(&slice, 1), this);
    open_ = Done();
  }

  /// Reads the answers, and returns how the call ended.
  grpc::Status Finish() {
    if (open_) {
      call_->WritesDone(this);
      Done();
    }
    int count = 0;
    do {
      call_->Read(&answer_, this);
    } while (Done() && ++count < kMostAnswers);
    if (count == kMostAnswers || lasts_) context_.TryCancel();
    grpc::Status status;
    call_->Finish(&status, this);
    Done();
    return status;
  }

  bool lasts() const { return lasts_; }

 private:
  bool Done() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
  grpc::ByteBuffer answer_;
  const bool lasts_;
  bool open_ = false;
};

/// A daemon, which each input finds alike.
class FuzzedDaemon {
 public:
  FuzzedDaemon() {
    WriteRecords(rooms_.folder / "model", SampleRecords(*SmallModel()));
    rooms_.Serve({.client_share = 1});
    channel_ = grpc::CreateChannel(rooms_.address, grpc::InsecureChannelCredentials());
    scenes_ = v1::SceneService::NewStub(channel_);
    StoreModel();
    MakeScene();
  }

  void Take(const RequestCase& request) {
    RawCall call(channel_, request.method);
    for (const std::string& message : request.messages) call.Write(message);
    Judge(request.method, call.Finish(), call.lasts());
    if (absl::StrContains(request.method, "Model") || absl::EndsWith(request.method, "Garbage")) {
      StoreModel();
    }
    if (absl::StrContains(request.method, "SceneService")) MakeScene();
  }

 private:
  static void Judge(const std::string& method, const grpc::Status& status, bool lasts) {
    const bool hangs = status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED && !lasts;
    const bool fails = status.error_code() == grpc::StatusCode::UNKNOWN ||
                       absl::StartsWith(status.error_message(), "INTERNAL: ") ||
                       absl::StartsWith(status.error_message(), "DATABASE_");
    if (!hangs && !fails) return;
    std::fprintf(stderr, "%s: %d %s\n", method.c_str(), status.error_code(),
                 status.error_message().c_str());
    __builtin_trap();
  }

  void StoreModel() {
    if (rooms_.database->models().Summary(SmallModel()->digest).ok()) return;
    if (!rooms_.database->models()
             .PutFile(SmallModel()->digest, "small", rooms_.folder / "model")
             .ok()) {
      __builtin_trap();
    }
  }

  /// Leaves no scene but a new one.
  void MakeScene() {
    v1::ListScenesResponse list;
    Call(&v1::SceneService::Stub::ListScenes, v1::ListScenesRequest(), list);
    for (const v1::Scene& scene : list.scenes()) {
      v1::DeleteSceneRequest old;
      old.set_name(scene.name());
      v1::DeleteSceneResponse ignored;
      Call(&v1::SceneService::Stub::DeleteScene, old, ignored);
    }
    v1::CreateSceneRequest wanted;
    wanted.set_id("fuzz");
    v1::CreateSceneResponse scene;
    Call(&v1::SceneService::Stub::CreateScene, wanted, scene);
    v1::AddObjectsRequest objects;
    objects.set_scene(scene.name());
    v1::NewObject& object = *objects.add_objects();
    object.set_modal_model("modalModels/" + SmallModel()->digest);
    object.mutable_material()->set_preset("chime_aluminum");
    object.mutable_material()->set_poisson_ratio(SmallModel()->poisson_ratio);
    v1::AddObjectsResponse added;
    Call(&v1::SceneService::Stub::AddObjects, objects, added);
  }

  template <typename Method, typename Request, typename Response>
  void Call(Method method, const Request& request, Response& response) {
    grpc::ClientContext context;
    const grpc::Status status = (*scenes_.*method)(&context, request, &response);
    if (status.ok()) return;
    std::fprintf(stderr, "%s\n", status.error_message().c_str());
    __builtin_trap();
  }

  DaemonRooms rooms_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::SceneService::Stub> scenes_;
};

}  // namespace
}  // namespace carillon

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static auto* const daemon = new carillon::FuzzedDaemon;
  const auto request = carillon::ParseRequestCase({reinterpret_cast<const char*>(data), size});
  if (request) daemon->Take(*request);
  return 0;
}
