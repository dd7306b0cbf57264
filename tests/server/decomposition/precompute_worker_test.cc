// SPDX-License-Identifier: Apache-2.0
//
// The queue with carillon-precompute itself.

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
};

TEST_F(PrecomputeWorkerTest, MakesTheModelOfACubeOfANegativePoissonsRatio) {
  v1::CreateModalModelRequest request = Request(kCube, 40'000);
  request.mutable_settings()->set_poisson_ratio(-0.25);
  const v1::Job job = SubmitAndAwaitEnd(request);
  ASSERT_EQ(job.state(), v1::JOB_STATE_SUCCEEDED) << job.error().message();
  EXPECT_EQ(database_->models().Summary(DigestOf(job))->header.mesh_digest(),
            request.mesh_digest());
  const auto model = *database_->models().Find(DigestOf(job));
  EXPECT_EQ(model->poisson_ratio, -0.25);
  EXPECT_LE(model->eigenvalues.back(), model->complete_to_eigenvalue);
  EXPECT_GE(model->complete_to_eigenvalue, WantedEigenvalue(*ResolveRequest(request)) * (1 - 1e-9));
  EXPECT_EQ(queue_->Submit(request)->state(), v1::JOB_STATE_SUCCEEDED) << "known by now";
}

TEST_F(PrecomputeWorkerTest, TellsTheFirstModeOfABodyThatIsTooHighAndTakesAHigherBand) {
  const v1::Job job = SubmitAndAwaitEnd(Request(kCube, 1'000));
  EXPECT_EQ(job.error().reason(), "NO_MODE_IN_BAND");
  EXPECT_GT(std::stod(job.error().metadata().at("first_mode_hz")), 5'000);
  EXPECT_EQ(SubmitAndAwaitEnd(Request(kCube, 40'000)).state(), v1::JOB_STATE_SUCCEEDED);
}

}  // namespace
}  // namespace carillon
