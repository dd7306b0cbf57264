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

/// What a daemon knows, which its clients reach or do not.
class FakeDaemon {
 public:
  void Restart() {
    const absl::MutexLock lock(&mutex);
    scenes.clear();
    ++epoch;
  }
  void SetReachable(bool now) {
    const absl::MutexLock lock(&mutex);
    reachable = now;
    if (!now) ++epoch;
  }
  void Refuse(const absl::Status& status) {
    const absl::MutexLock lock(&mutex);
    refusal = status;
  }
  std::vector<uint32_t> Handles(const std::string& id) {
    const absl::MutexLock lock(&mutex);
    std::vector<uint32_t> handles;
    for (const auto& [handle, model] : scenes[id]) handles.push_back(handle);
    return handles;
  }

  absl::Mutex mutex;
  std::map<std::string, std::map<uint32_t, std::string>> scenes ABSL_GUARDED_BY(mutex);
  bool reachable ABSL_GUARDED_BY(mutex) = true;
  int epoch ABSL_GUARDED_BY(mutex) = 0;  ///< of connections
  absl::Status refusal ABSL_GUARDED_BY(mutex);
  std::atomic<uint64_t> step_count{0};
  std::atomic<int> stream_count{0};
};

class FakeStream final : public ContactStream {
 public:
  FakeStream(FakeDaemon& daemon, int epoch) : daemon_(daemon), epoch_(epoch) {}

  absl::Status Send(v1::ContactStep) override {
    const absl::MutexLock lock(&daemon_.mutex);
    if (daemon_.epoch != epoch_) return Gone();
    report_.set_step_count(report_.step_count() + 1);
    ++daemon_.step_count;
    return absl::OkStatus();
  }
  v1::StreamContactsResponse Report() const override { return report_; }
  absl::StatusOr<v1::StreamContactsResponse> Finish() override { return report_; }

 private:
  FakeDaemon& daemon_;
  const int epoch_;
  v1::StreamContactsResponse report_;
};

class FakeClient final : public Client {
 public:
  explicit FakeClient(FakeDaemon& daemon) : daemon_(daemon) {}

  absl::StatusOr<v1::CreateSceneResponse> CreateScene(
      const v1::CreateSceneRequest& request) const override {
    const absl::MutexLock lock(&daemon_.mutex);
    if (!daemon_.reachable) return Gone();
    if (!daemon_.refusal.ok()) return daemon_.refusal;
    v1::CreateSceneResponse response;
    response.set_name("scenes/" + request.id());
    response.set_existing(daemon_.scenes.contains(request.id()));
    daemon_.scenes[request.id()];
    return response;
  }
  absl::StatusOr<std::vector<v1::SoundingObject>> ListObjects(
      const std::string& scene) const override {
    const absl::MutexLock lock(&daemon_.mutex);
    std::vector<v1::SoundingObject> objects;
    for (const auto& [handle, model] : daemon_.scenes[scene.substr(7)]) {
      objects.emplace_back().set_handle(handle);
      objects.back().set_modal_model(model);
    }
    return objects;
  }
  absl::StatusOr<std::vector<v1::SoundingObject>> AddObjects(
      const v1::AddObjectsRequest& request) const override {
    const absl::MutexLock lock(&daemon_.mutex);
    for (const v1::NewObject& object : request.objects()) {
      daemon_.scenes[request.scene().substr(7)][object.handle()] = object.modal_model();
    }
    return std::vector<v1::SoundingObject>();
  }
  absl::StatusOr<std::unique_ptr<ContactStream>> StreamContacts(
      const v1::ContactStreamStart& start) const override {
    EXPECT_EQ(start.scene(), "scenes/lathe");
    const absl::MutexLock lock(&daemon_.mutex);
    if (!daemon_.reachable) return Gone();
    ++daemon_.stream_count;
    return std::make_unique<FakeStream>(daemon_, daemon_.epoch);
  }

 private:
  FakeDaemon& daemon_;
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
    auto opened = OpenLastingStream(client_, Lathe(), {}, std::chrono::milliseconds(1));
    EXPECT_TRUE(opened.ok()) << opened.status();
    return *std::move(opened);
  }

  FakeDaemon daemon_;
  const FakeClient client_{daemon_};
};

TEST_F(LastingStreamTest, RegistersTheSceneAgainAfterARestartAndSendsOn) {
  const auto stream = Open();
  EXPECT_EQ(stream->Send({}), absl::OkStatus());
  daemon_.Restart();
  EXPECT_THAT(daemon_.Handles("lathe"), ElementsAre());
  uint64_t sent = 1;
  for (; daemon_.step_count < 2; ++sent) ASSERT_EQ(stream->Send({}), absl::OkStatus());
  EXPECT_THAT(daemon_.Handles("lathe"), ElementsAre(1, 2));
  EXPECT_EQ(daemon_.stream_count, 2);
  EXPECT_EQ(stream->DroppedStepCount() + daemon_.step_count, sent);
  EXPECT_GE(stream->DroppedStepCount(), 1U);
  EXPECT_EQ(stream->Finish()->step_count(), 1U);
}

TEST_F(LastingStreamTest, AddsOnlyTheObjectsThatASceneLacks) {
  ASSERT_TRUE(RegisterScene(client_, Lathe()).ok());
  {
    const absl::MutexLock lock(&daemon_.mutex);
    daemon_.scenes["lathe"].erase(2);
    daemon_.scenes["lathe"][9] = "modalModels/b";
  }
  EXPECT_EQ(*RegisterScene(client_, Lathe()), "scenes/lathe");
  EXPECT_THAT(daemon_.Handles("lathe"), ElementsAre(1, 2, 9));
  SceneRegistration other = Lathe();
  other.objects[1].set_modal_model("modalModels/b");
  EXPECT_THAT(RegisterScene(client_, other).status().ToString(),
              HasSubstr("OBJECT_EXISTS: scenes/lathe/objects/2 has the model modalModels/a"));
}

TEST_F(LastingStreamTest, WaitsForADaemonThatIsAwayAndEndsWithoutIt) {
  auto stream = Open();
  daemon_.SetReachable(false);
  for (int i = 0; i < 100; ++i) ASSERT_EQ(stream->Send({}), absl::OkStatus());
  EXPECT_EQ(stream->DroppedStepCount(), 100U);
  EXPECT_EQ(stream->Finish().status().code(), absl::StatusCode::kUnavailable);
  stream = nullptr;
  EXPECT_EQ(OpenLastingStream(client_, Lathe(), {}).status(), Gone());
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
  EXPECT_THAT(RegisterScene(client_, nameless).status().ToString(), HasSubstr("INVALID_SETTINGS"));
  SceneRegistration unnumbered = Lathe();
  unnumbered.objects[1].clear_handle();
  EXPECT_THAT(RegisterScene(client_, unnumbered).status().ToString(), HasSubstr("objects[1]"));
  EXPECT_EQ(daemon_.stream_count, 0);
}

}  // namespace
}  // namespace carillon::client
