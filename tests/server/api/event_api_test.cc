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
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::MatchesRegex;
using testing::Not;
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

  /// Stores a mesh file, and returns its digest.
  std::string Upload(const std::string& bytes) {
    grpc::ClientContext context;
    v1::UploadMeshResponse uploaded;
    const auto writer = models->UploadMesh(&context, &uploaded);
    v1::UploadMeshRequest mesh;
    mesh.set_data(bytes);
    writer->Write(mesh);
    writer->WritesDone();
    EXPECT_TRUE(writer->Finish().ok());
    return uploaded.mesh_digest();
  }

  /// Requests a job that fails.
  v1::Job Submit(const std::string& label) {
    v1::CreateModalModelRequest request;
    request.set_mesh_digest(Upload("the mesh of " + label));
    request.set_mesh_format("obj");
    request.mutable_material()->set_preset("chime_aluminum");
    request.set_label(label);
    v1::CreateModalModelResponse response;
    EXPECT_TRUE(
        Call(*models, &v1::ModalModelService::Stub::CreateModalModel, request, response).ok());
    return response.job();
  }

  void Cancel(const std::string& job) {
    v1::CancelJobRequest request;
    request.set_name(job);
    v1::CancelJobResponse response;
    EXPECT_TRUE(Call(*jobs, &v1::DecompositionService::Stub::CancelJob, request, response).ok());
  }

  /// The end of each line of an event that a call of this process has caused.
  const std::string by_ = absl::StrCat(" caller=local peer=unix:pid-", getpid());
  std::unique_ptr<v1::AdminService::Stub> admin;
};

TEST_F(EventApi, AnUploadNamesTheMeshAndTheCaller) {
  const std::string mesh = Upload("solid");
  EXPECT_THAT(events(), ElementsAre(absl::StrCat("mesh_stored mesh=", mesh, " bytes=5", by_)));
}

TEST_F(EventApi, ACollectionWithoutABudgetIsRefusedAndDeletesNothing) {
  grpc::ClientContext context;
  v1::CollectGarbageResponse response;
  ASSERT_TRUE(Call(*admin, &v1::AdminService::Stub::CollectGarbage, request, response).ok());
  EXPECT_THAT(events(), Not(Contains(StartsWith("model_deleted"))));
  request.set_dry_run(false);
  ASSERT_TRUE(Call(*admin, &v1::AdminService::Stub::CollectGarbage, request, response).ok());
  const std::string bytes = absl::StrCat(response.deleted_bytes());
  EXPECT_THAT(events(), IsSupersetOf({absl::StrCat("model_deleted model=", model, " bytes=", bytes,
                                                   " cause=collection", by_),
                                      absl::StrCat("models_collected count=1 bytes=", bytes,
                                                   " mesh_count=0 mesh_bytes=0", by_)}));
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

TEST_F(EventApi, ACancellationNamesTheJobAndTheCaller) {
  // The first jobs keep the workers busy while the last one waits, unless this thread is too slow.
  for (int round = 0; round < 100; ++round) {
    v1::Job last;
    for (int i = 0; i < 10; ++i) last = Submit(absl::StrCat("bell_", round, "_", i));
    Cancel(last.name());
    const auto is_cancelled = [](const std::string& line) {
      return line.rfind("job_canc", 0) == 0;
    };
    const std::vector<std::string> lines = events();
    const auto found = std::ranges::find_if(lines, is_cancelled);
    if (found == lines.end()) continue;
    EXPECT_EQ(*found, "job_cancelled job=" + last.name() + " label=" + last.label() + by_);
    return;
  }
  FAIL() << "no job could be cancelled";
}

TEST_F(EventApi, TheCancellationOfAJobThatHasEndedIsNone) {
  const v1::Job job = Submit("bell");
  Await("job_failed job=" + job.name());
  Cancel(job.name());
  EXPECT_THAT(events(), Not(Contains(StartsWith("job_cancelled"))));
}

TEST_F(EventApi, AChangeOfTheMixerTellsTheNewGain) {
  v1::UpdateMixerRequest request;
  request.set_gain(0.5);
  v1::UpdateMixerResponse response;
  ASSERT_TRUE(Call(*audio, &v1::AudioService::Stub::UpdateMixer, request, response).ok());
  EXPECT_THAT(events(), ElementsAre("mixer_changed gain=0.5 muted=false" + by_));
  request.set_gain(-1);
  EXPECT_FALSE(Call(*audio, &v1::AudioService::Stub::UpdateMixer, request, response).ok());
  EXPECT_THAT(events(), testing::SizeIs(1));
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

class EventsWithoutAdministrator : public ServedDaemon {
 protected:
  EventsWithoutAdministrator() : ServedDaemon({}, {"127.0.0.1:0"}) {}
};

TEST_F(EventsWithoutAdministrator, ARefusalNamesTheCall) {
  const auto tcp = grpc::CreateChannel(addresses().back(), grpc::InsecureChannelCredentials());
  const auto stub = v1::ModalModelService::NewStub(tcp);
  v1::DeleteModalModelRequest request;
  v1::DeleteModalModelResponse response;
  EXPECT_FALSE(Call(*stub, &v1::ModalModelService::Stub::DeleteModalModel, request, response).ok());
  grpc::ClientContext context;
  EXPECT_FALSE(v1::AdminService::NewStub(tcp)->BackUpDatabase(&context, {})->Finish().ok());
  EXPECT_THAT(events(), IsEmpty());
  EXPECT_THAT(log(), AllOf(HasSubstr("a call of /carillon.v1.ModalModelService/DeleteModalModel "
                                     "from ipv4:127.0.0.1:"),
                           HasSubstr("a call of /carillon.v1.AdminService/BackUpDatabase from "),
                           HasSubstr(" was refused: CREDENTIAL_MISSING: ")));
}

TEST_F(EventsWithoutAdministrator, LossAndReturnOfDecompositionsNameTheCause) {
  for (const bool can : {false, true}) {
    SetCanDecompose(can);
    const std::string line = can ? "decompositions_possible"
                                 : "decompositions_impossible error=\"WORKER_NOT_FOUND: none\"";
    while (!std::ranges::count(events(), line)) {
    }
  }
  EXPECT_THAT(events(), testing::SizeIs(2));
}

TEST(CallName, AFunctionThatServesACallHasItsFullName) {
  EXPECT_EQ(CallName("Listen"), "/carillon.v1.AudioService/Listen");
  EXPECT_EQ(CallName("ImportModalModelRaw"), "/carillon.v1.ModalModelService/ImportModalModel");
  EXPECT_EQ(CallName("Unheard"), "Unheard");
}

}  // namespace
}  // namespace carillon
