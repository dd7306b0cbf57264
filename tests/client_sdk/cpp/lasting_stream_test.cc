// SPDX-License-Identifier: Apache-2.0
#include "carillon/lasting_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace carillon::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

absl::Status Gone() { return absl::UnavailableError("SERVER_UNAVAILABLE: no daemon"); }

/// A daemon that clients reach or do not, as a client sees it.
class FakeDaemon final : public Client {
 public:
  void Restart() {
    const absl::MutexLock lock(&mutex_);
    scenes_.clear();
    ++epoch_;
  }
  void Leave() {
    const absl::MutexLock lock(&mutex_);
    reachable_ = false;
    ++epoch_;
  }
  void Refuse(const absl::Status& status) {
    const absl::MutexLock lock(&mutex_);
    refusal_ = status;
  }
  /// Replaces the objects of the scene, models by handles.
  void Put(const std::map<uint32_t, std::string>& objects) {
    const absl::MutexLock lock(&mutex_);
    scenes_["lathe"] = objects;
  }
  std::vector<uint32_t> Handles() const {
    const absl::MutexLock lock(&mutex_);
    std::vector<uint32_t> handles;
    for (const auto& [handle, model] : scenes_["lathe"]) handles.push_back(handle);
    return handles;
  }

  absl::StatusOr<v1::CreateSceneResponse> CreateScene(
      const v1::CreateSceneRequest& request) const override {
    const absl::MutexLock lock(&mutex_);
    if (!reachable_) return Gone();
    if (!refusal_.ok()) return refusal_;
    v1::CreateSceneResponse response;
    response.set_name("scenes/" + request.id());
    response.set_existing(scenes_.contains(request.id()));
    scenes_[request.id()];
    return response;
  }
  absl::StatusOr<std::vector<v1::SoundingObject>> ListObjects(
      const std::string& scene) const override {
    const absl::MutexLock lock(&mutex_);
    std::vector<v1::SoundingObject> objects;
    for (const auto& [handle, model] : scenes_[scene.substr(7)]) {
      objects.emplace_back().set_handle(handle);
      objects.back().set_modal_model(model);
    }
    return objects;
  }
  absl::StatusOr<std::vector<v1::SoundingObject>> AddObjects(
      const v1::AddObjectsRequest& request) const override {
    const absl::MutexLock lock(&mutex_);
    for (const v1::NewObject& object : request.objects()) {
      scenes_[request.scene().substr(7)][object.handle()] = object.modal_model();
    }
    return std::vector<v1::SoundingObject>();
  }
  absl::StatusOr<std::unique_ptr<ContactStream>> StreamContacts(
      const v1::ContactStreamStart& start) const override {
    EXPECT_EQ(start.scene(), "scenes/lathe");
    const absl::MutexLock lock(&mutex_);
    if (!reachable_) return Gone();
    ++stream_count;
    return std::make_unique<FakeStream>(*this, epoch_);
  }

  mutable std::atomic<uint64_t> step_count{0};
  mutable std::atomic<int> stream_count{0};

 private:
  /// A stream of one epoch of connections.
  class FakeStream final : public ContactStream {
   public:
    FakeStream(const FakeDaemon& daemon, int epoch) : daemon_(daemon), epoch_(epoch) {}

    absl::Status Send(v1::ContactStep) override {
      const absl::MutexLock lock(&daemon_.mutex_);
      if (daemon_.epoch_ != epoch_) return Gone();
      report_.set_step_count(report_.step_count() + 1);
      ++daemon_.step_count;
      return absl::OkStatus();
    }
    v1::StreamContactsResponse Report() const override { return report_; }
    absl::StatusOr<v1::StreamContactsResponse> Finish() override { return report_; }

   private:
    const FakeDaemon& daemon_;
    const int epoch_;
    v1::StreamContactsResponse report_;
  };

  mutable absl::Mutex mutex_;
  mutable std::map<std::string, std::map<uint32_t, std::string>> scenes_ ABSL_GUARDED_BY(mutex_);
  bool reachable_ ABSL_GUARDED_BY(mutex_) = true;
  int epoch_ ABSL_GUARDED_BY(mutex_) = 0;
  absl::Status refusal_ ABSL_GUARDED_BY(mutex_);
};

SceneRegistration Lathe() {
  SceneRegistration registration;
  registration.scene.set_id("lathe");
  for (const uint32_t handle : {1, 2}) {
    registration.objects.emplace_back().set_handle(handle);
    registration.objects.back().set_modal_model("modalModels/a");
  }
  return registration;
}

class LastingStreamTest : public testing::Test {
 protected:
  std::unique_ptr<ContactStream> Open() {
    auto opened = OpenLastingStream(daemon_, Lathe(), {}, std::chrono::milliseconds(1));
    EXPECT_TRUE(opened.ok()) << opened.status();
    return *std::move(opened);
  }

  FakeDaemon daemon_;
};

TEST_F(LastingStreamTest, RegistersTheSceneAgainAfterARestartAndSendsOn) {
  const auto stream = Open();
  EXPECT_EQ(stream->Send({}), absl::OkStatus());
  daemon_.Restart();
  EXPECT_THAT(daemon_.Handles(), ElementsAre());
  uint64_t sent = 1;
  for (; daemon_.step_count < 2; ++sent) ASSERT_EQ(stream->Send({}), absl::OkStatus());
  EXPECT_THAT(daemon_.Handles(), ElementsAre(1, 2));
  EXPECT_EQ(daemon_.stream_count, 2);
  EXPECT_EQ(stream->DroppedStepCount() + daemon_.step_count, sent);
  EXPECT_GE(stream->DroppedStepCount(), 1U);
  EXPECT_EQ(stream->Finish()->step_count(), 1U);
}

TEST_F(LastingStreamTest, AddsOnlyTheObjectsThatASceneLacks) {
  ASSERT_TRUE(RegisterScene(daemon_, Lathe()).ok());
  daemon_.Put({{1, "modalModels/a"}, {9, "modalModels/b"}});
  EXPECT_EQ(*RegisterScene(daemon_, Lathe()), "scenes/lathe");
  EXPECT_THAT(daemon_.Handles(), ElementsAre(1, 2, 9));
  SceneRegistration other = Lathe();
  other.objects[1].set_modal_model("modalModels/b");
  EXPECT_THAT(RegisterScene(daemon_, other).status().ToString(),
              HasSubstr("OBJECT_EXISTS: scenes/lathe/objects/2 has the model modalModels/a"));
}

TEST_F(LastingStreamTest, WaitsForADaemonThatIsAwayAndEndsWithoutIt) {
  auto stream = Open();
  daemon_.Leave();
  for (int i = 0; i < 100; ++i) ASSERT_EQ(stream->Send({}), absl::OkStatus());
  EXPECT_EQ(stream->DroppedStepCount(), 100U);
  EXPECT_EQ(stream->Finish().status().code(), absl::StatusCode::kUnavailable);
  stream = nullptr;
  EXPECT_EQ(OpenLastingStream(daemon_, Lathe(), {}).status(), Gone());
}

TEST_F(LastingStreamTest, ARefusalEndsItForGood) {
  const auto stream = Open();
  const absl::Status differs = absl::AlreadyExistsError("SCENE_DIFFERS: made otherwise");
  daemon_.Refuse(differs);
  daemon_.Restart();
  absl::Status sent;
  while (sent.ok()) sent = stream->Send({});
  EXPECT_EQ(sent, differs);
  EXPECT_EQ(stream->Finish().status(), differs);
}

TEST_F(LastingStreamTest, NeedsAnIdAndHandles) {
  SceneRegistration nameless = Lathe();
  nameless.scene.clear_id();
  EXPECT_THAT(RegisterScene(daemon_, nameless).status().ToString(), HasSubstr("INVALID_SETTINGS"));
  SceneRegistration unnumbered = Lathe();
  unnumbered.objects[1].clear_handle();
  EXPECT_THAT(RegisterScene(daemon_, unnumbered).status().ToString(), HasSubstr("objects[1]"));
  EXPECT_EQ(daemon_.stream_count, 0);
}

}  // namespace
}  // namespace carillon::client
