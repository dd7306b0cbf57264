// SPDX-License-Identifier: Apache-2.0
//
// What the log tells of calls. Every job of this daemon fails.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "carillon/v1/admin_service.grpc.pb.h"
#include "server/api/edge/access/call_name.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::MatchesRegex;
using testing::StartsWith;

class EventApi : public ServedDaemon {
 protected:
  EventApi() : admin(v1::AdminService::NewStub(channel())) {}

  /// Waits for an event, because a stream's end reaches the client before the log.
  void Await(const std::string& name) {
    while (!HasEvent(name)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  bool HasEvent(const std::string& name) {
    return std::ranges::any_of(events(),
                               [&](const std::string& line) { return line.rfind(name, 0) == 0; });
  }

  /// The end of each line of an event that a call of this process has caused.
  const std::string by_ = absl::StrCat(" caller=local peer=unix:pid-", getpid());
  std::unique_ptr<v1::AdminService::Stub> admin;
};

TEST_F(EventApi, AnUploadNamesTheMeshAndTheCaller) {
  const std::string mesh = RequestFor("solid").mesh_digest();
  EXPECT_THAT(events(), ElementsAre(absl::StrCat("mesh_stored mesh=", mesh, " bytes=5", by_)));
}

TEST_F(EventApi, ACollectionWithoutABudgetIsRefusedAndDeletesNothing) {
  grpc::ClientContext context;
  v1::CollectGarbageResponse response;
  ExpectRefused(admin->CollectGarbage(&context, {}, &response), grpc::INVALID_ARGUMENT,
                "INVALID_SETTINGS");
  EXPECT_THAT(events(), ElementsAre());
}

TEST_F(EventApi, ABackupTellsItsSizeAndHowItEnded) {
  grpc::ClientContext context;
  const auto reader = admin->BackUpDatabase(&context, {});
  v1::BackUpDatabaseResponse piece;
  uint64_t byte_count = 0;
  while (reader->Read(&piece)) byte_count += piece.data().size();
  EXPECT_TRUE(reader->Finish().ok());
  Await(absl::StrCat("database_backed_up outcome=sent bytes=", byte_count, by_));
  // The daemon does not see a call that is cancelled too early, and has sent all if it is too late.
  for (int i = 0; !HasEvent("database_backed_up outcome=cancelled bytes="); i = (i + 1) % 20) {
    grpc::ClientContext cancelled;
    const auto unread = admin->BackUpDatabase(&cancelled, {});
    std::this_thread::sleep_for(std::chrono::milliseconds(i));
    cancelled.TryCancel();
    unread->Finish().ok();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

TEST_F(EventApi, AJobIsToldWhenItIsSubmittedAndWhenItFails) {
  const v1::Job job = Submit("bell");
  Await("job_failed job=" + job.name());
  EXPECT_THAT(events(), Contains(MatchesRegex("job_submitted job=" + job.name() +
                                              " label=bell state=(queued|running)" + by_)));
  EXPECT_THAT(events(), Contains(AllOf(StartsWith("job_failed job=" + job.name() + " reason="),
                                       HasSubstr(" message="), HasSubstr(" label=bell"))));
}

TEST_F(EventApi, AScenesBeginningAndEndAreTold) {
  v1::DeleteSceneRequest request;
  request.set_name(CreateScene());
  v1::DeleteSceneResponse response;
  ASSERT_TRUE(Call(*scenes, &v1::SceneService::Stub::DeleteScene, request, response).ok());
  EXPECT_THAT(events(), ElementsAre("scene_created scene=" + request.name() + by_,
                                    "scene_deleted scene=" + request.name() + by_));
}

TEST_F(EventApi, AFloodOfScenesIsLimitedAndWhatAdministratorsDoIsAllTold) {
  for (int i = 0; i < 40; ++i) CreateScene();
  const auto is_scene = [](const std::string& line) { return line.rfind("scene_created", 0) == 0; };
  EXPECT_LT(std::ranges::count_if(events(), is_scene), 40);
  v1::UpdateMixerRequest request;
  v1::UpdateMixerResponse response;
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(Call(*audio, &v1::AudioService::Stub::UpdateMixer, request, response).ok());
  }
  const auto is_mixer = [](const std::string& line) { return line.rfind("mixer_changed", 0) == 0; };
  EXPECT_EQ(std::ranges::count_if(events(), is_mixer), 40);
}

TEST(CallName, AFunctionThatServesACallHasItsFullName) {
  EXPECT_EQ(CallName("Listen"), "/carillon.v1.AudioService/Listen");
  EXPECT_EQ(CallName("ImportModalModelRaw"), "/carillon.v1.ModalModelService/ImportModalModel");
  EXPECT_EQ(CallName("Unheard"), "Unheard");
}

}  // namespace
}  // namespace carillon
