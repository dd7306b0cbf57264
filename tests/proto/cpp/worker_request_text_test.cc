// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/worker_request_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carillon {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(WorkerRequestText, ReadsBackEveryDigitAndEveryByte) {
  worker::v1::WorkerRequest request;
  request.set_mesh_format("obj");
  request.mutable_settings()->set_poisson_ratio(-0.1);
  request.mutable_settings()->mutable_mesh()->set_keep_surface(false);
  request.mutable_settings()->add_fixtures()->set_group("END_OF_REQUEST\n\"' \u00e9");
  request.mutable_settings()->add_fixtures()->mutable_vertices()->add_indices(4'000'000'000);
  request.set_max_frequency_hz(1 / 3.0);
  const auto read = ParseWorkerRequest(WorkerRequestText(request));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->SerializeAsString(), request.SerializeAsString());
}

// A group may be called as a shell script ends its input.
TEST(WorkerRequestText, HasNoLineThatIsOneWord) {
  worker::v1::WorkerRequest request;
  request.mutable_settings()->add_fixtures()->set_group("a\nEND_OF_REQUEST\nb");
  EXPECT_THAT(WorkerRequestText(request), ::testing::Not(HasSubstr("\nEND_OF_REQUEST\n")));
}

TEST(WorkerRequestText, RefusesASettingThatItDoesNotKnow) {
  const auto read = ParseWorkerRequest("mesh_format: \"obj\"\nsettings { colour: 3 }");
  EXPECT_THAT(read.status().ToString(),
              AllOf(HasSubstr("INVALID_SETTINGS"), HasSubstr("line 2"), HasSubstr("colour")));
}

}  // namespace
}  // namespace carillon
