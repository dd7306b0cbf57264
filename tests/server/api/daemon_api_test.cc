// SPDX-License-Identifier: Apache-2.0
//
// What the log tells of calls, and what the daemon tells of itself. Every job of this daemon fails.
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "carillon/v1/admin_service.grpc.pb.h"
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
  EventApi() : admin(v1::AdminService::NewStub(channel_)) {}

  /// Waits for an event, because a stream's end reaches the client before the log.
  void Await(const std::string& name) {
    while (!HasEvent(name)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }

  bool HasEvent(const std::string& name) {
    return std::ranges::any_of(events(),
                               [&](const std::string& line) { return line.starts_with(name); });
  }

  /// The end of each line of an event that a call of this process has caused.
  const std::string by_ = absl::StrCat(" caller=local peer=unix:pid-", getpid());
  std::unique_ptr<v1::AdminService::Stub> admin;
};

TEST_F(EventApi, AnUploadNamesTheMeshByTheDigestOfItsBytesAndTheCaller) {
  v1::UploadMeshResponse stored;
  ASSERT_TRUE(Upload({"ab", "c"}, stored).ok());
  EXPECT_EQ(stored.mesh_digest(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-4
  EXPECT_EQ(stored.byte_count(), 3U);
  EXPECT_THAT(events(), ElementsAre(absl::StrCat("mesh_stored mesh=", stored.mesh_digest(),
                                                 " bytes=3", by_)));
}

TEST_F(EventApi, ACollectionWithoutABudgetIsRefusedAndDeletesNothing) {
  ExpectRefused(Call(*admin, &v1::AdminService::Stub::CollectGarbage, {}), kInvalid,
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
  const std::string scene = CreateScene();
  Called(*scenes, &SceneStub::DeleteScene, Named<v1::DeleteSceneRequest>(scene));
  EXPECT_THAT(events(), ElementsAre("scene_created scene=" + scene + by_,
                                    "scene_deleted scene=" + scene + by_));
}

TEST_F(EventApi, AFloodOfScenesIsLimitedAndWhatAdministratorsDoIsAllTold) {
  for (int i = 0; i < 40; ++i) {
    CreateScene();
    Called(*audio, &AudioStub::UpdateMixer, {});
  }
  const auto count_of = [this](const std::string& name) {
    return std::ranges::count_if(events(),
                                 [&](const std::string& line) { return line.starts_with(name); });
  };
  EXPECT_LT(count_of("scene_created"), 40);
  EXPECT_EQ(count_of("mixer_changed"), 40);
}

class ServerInfoApi : public ServedDaemon {
 protected:
  explicit ServerInfoApi(const ApiSettings& settings = {.scene_grace_s = 7, .client_share = 0.25})
      : ServedDaemon(settings) {}

  v1::GetServerInfoResponse Info() {
    return Called(*info, &v1::ServerService::Stub::GetServerInfo, {});
  }
};

TEST_F(ServerInfoApi, HasTheAgeOutputLimitsAndSettingsOfThisDaemon) {
  const v1::GetServerInfoResponse answer = Info();
  EXPECT_EQ(answer.channel_count(), output_->format().channel_count);
  const int64_t age_ms = SystemClock().UnixMs() - answer.started_unix_ms();
  EXPECT_LT(std::abs(static_cast<double>(age_ms) / 1000 - answer.uptime_s()), 60);
  const v1::ServerLimits& limits = answer.limits();
  EXPECT_EQ(limits.scene_grace_s(), 7);
  EXPECT_EQ(limits.client_share(), 0.25);
  // The rest is what proto/README.md says.
  EXPECT_EQ(limits.scene_count(), 512U);
  EXPECT_EQ(limits.object_count(), 4096U);
  EXPECT_EQ(limits.sounding_mode_count(), 800U);
  EXPECT_EQ(limits.contact_stream_count(), 2048U);
  EXPECT_EQ(limits.listener_count(), 32U);
  EXPECT_EQ(limits.rendering_count(), 8U);
  EXPECT_EQ(limits.waiting_job_count(), 1024U);
  EXPECT_EQ(limits.mesh_bytes(), uint64_t{256} << 20U);
  EXPECT_EQ(limits.page_size(), 1000U);
}

TEST_F(ServerInfoApi, AMessageOfTheLargestSizeIsReadAndOneByteMoreIsNot) {
  v1::CreateModalModelRequest request;
  request.set_label("x");
  const size_t rest = Info().limits().message_bytes() - request.ByteSizeLong();
  // The length of a label takes two bytes more when it is longer.
  for (const auto& [size, read] : {std::pair(rest - 1, true), std::pair(rest, false)}) {
    request.set_label(std::string(size, 'x'));
    const grpc::Status status = Call(*models, &ModelStub::CreateModalModel, request);
    EXPECT_EQ(status.error_code(), read ? kInvalid : grpc::RESOURCE_EXHAUSTED)
        << request.ByteSizeLong() << ": " << status.error_message();
  }
}

/// A daemon whose decompositions run on a cluster.
class ClusterInfoApi : public ServerInfoApi {
 protected:
  ClusterInfoApi() : ServerInfoApi({.slurm = true}) {}
};

TEST_F(ClusterInfoApi, SlurmIsAFeature) {
  const v1::GetServerInfoResponse answer = Info();
  EXPECT_THAT(answer.features(), testing::Contains("slurm"));
  EXPECT_TRUE(std::ranges::is_sorted(answer.features()));
}

}  // namespace
}  // namespace carillon
