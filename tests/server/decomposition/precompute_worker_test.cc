// SPDX-License-Identifier: Apache-2.0
//
// The queue with carillon-precompute itself.

#include <set>

#include "tests/server/decomposition/queue_fixture.h"

namespace carillon {
namespace {

// A cube with edges of 100 mm. In aluminum its first mode lies between 5 and 40 kHz, since a shear
// wave of 3.1 km/s needs 32 us from face to face.
constexpr char kCube[] =
    "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\n"
    "v 0 0 100\nv 100 0 100\nv 100 100 100\nv 0 100 100\n"
    "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\n"
    "f 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";

class PrecomputeWorkerTest : public DecompositionQueueTest {
 protected:
  PrecomputeWorkerTest() {
    options_.program = CARILLON_PRECOMPUTE;
    StartQueue();
  }

  v1::CreateModalModelRequest Request(const std::string& mesh, double max_frequency_hz) {
    v1::CreateModalModelRequest request = SampleRequest(database_->meshes().Put(mesh)->digest);
    request.set_max_frequency_hz(max_frequency_hz);
    request.mutable_settings()->set_metres_per_unit(0.001);
    request.mutable_settings()->set_element(v1::ELEMENT_LINEAR);
    request.mutable_settings()->mutable_mesh()->set_target_node_count(100);
    return request;
  }

  v1::Job Finish(const v1::CreateModalModelRequest& request) {
    Diary diary;
    const auto watch = queue_->Watch(DigestOf(Submit(request)), [&](const v1::Job& now) {
      phases_.insert(now.progress().phase());
      diary.Write(now);
    });
    return diary.AwaitEnd();
  }

  std::set<v1::Phase> phases_;
};

TEST_F(PrecomputeWorkerTest, MakesTheModelOfACube) {
  const v1::CreateModalModelRequest request = Request(kCube, 40'000);
  const v1::Job job = Finish(request);
  ASSERT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.error().message();
  // How many events a short decomposition sends depends on its pace; some it does.
  EXPECT_GT(*phases_.rbegin(), v1::PHASE_UNSPECIFIED);
  const std::string digest = job.name().substr(5);
  const auto summary = database_->models().Summary(digest);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ(summary->header.mesh_digest(), request.mesh_digest());
  EXPECT_NEAR(summary->header.volume_m3(), 1e-3, 1e-9);  // a cube is meshed without loss
  const auto model = database_->models().Find(digest);
  ASSERT_TRUE(model.ok()) << model.status();
  const auto resolved = ResolveRequest(request);
  EXPECT_GT((*model)->eigenvalues.front(), UnitEigenvalue(*resolved, 5'000));
  EXPECT_LE((*model)->eigenvalues.back(), (*model)->complete_to_eigenvalue);
  EXPECT_GE((*model)->complete_to_eigenvalue, WantedEigenvalue(*resolved) * (1 - 1e-9));
  EXPECT_EQ(queue_->Submit(request)->state(), v1::JOB_STATE_SUCCEEDED) << "known by now";
}

TEST_F(PrecomputeWorkerTest, TakesANegativePoissonsRatio) {
  v1::CreateModalModelRequest request = Request(kCube, 40'000);
  request.mutable_settings()->set_poisson_ratio(-0.25);
  const v1::Job job = Finish(request);
  ASSERT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.error().message();
  EXPECT_EQ((*database_->models().Find(job.name().substr(5)))->poisson_ratio, -0.25);
}

TEST_F(PrecomputeWorkerTest, TellsTheFirstModeOfABodyThatIsTooHighAndTakesAHigherBand) {
  const v1::Job job = Finish(Request(kCube, 1'000));
  EXPECT_EQ(job.error().reason(), "NO_MODE_IN_BAND");
  EXPECT_GT(std::stod(job.error().metadata().at("first_mode_hz")), 5'000);
  EXPECT_EQ(Finish(Request(kCube, 40'000)).state(), v1::JOB_STATE_SUCCEEDED);
}

}  // namespace
}  // namespace carillon
