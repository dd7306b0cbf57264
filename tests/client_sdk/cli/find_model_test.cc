// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/find_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A daemon that lists these models and jobs.
class FakeDaemon : public client::Client {
 public:
  absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest&) const override {
    return models;
  }
  absl::StatusOr<v1::ModalModelSummary> GetModalModel(const std::string& name) const override {
    return Refusal(absl::StatusCode::kNotFound, "MODAL_MODEL_NOT_FOUND", name);
  }
  absl::StatusOr<v1::ListJobsResponse> ListJobsPage(const v1::ListJobsRequest&) const override {
    return jobs;
  }

  v1::ListModalModelsResponse models;
  v1::ListJobsResponse jobs;
};

/// The job whose name and model have a digest of this digit.
v1::Job Bell(v1::JobState state, char job = 'a', char model = 'a') {
  v1::Job bell;
  bell.set_name("jobs/" + std::string(64, job));
  bell.set_modal_model("modalModels/" + std::string(64, model));
  bell.set_label("bell");
  bell.set_state(state);
  return bell;
}

/// Returns the message of the error for a model that is not stored, while the daemon has the job.
std::string MessageOf(const v1::Job& job, const std::string& text) {
  FakeDaemon daemon;
  *daemon.jobs.add_jobs() = job;
  const v1::ErrorInfo error = ToErrorInfo(FindModel(daemon, text).status());
  EXPECT_EQ(error.reason(), "MODAL_MODEL_NOT_FOUND");
  return error.message();
}

TEST(FindJob, ALabelMeansTheJobThatHasNotEnded) {
  FakeDaemon daemon;
  for (const char job : {'a', 'b'}) *daemon.jobs.add_jobs() = Bell(v1::JOB_STATE_FAILED, job);
  EXPECT_EQ(ToErrorInfo(FindJob(daemon, "bell").status()).reason(), "NAME_AMBIGUOUS");
  daemon.jobs.mutable_jobs(1)->set_state(v1::JOB_STATE_QUEUED);
  EXPECT_EQ(FindJob(daemon, "bell").value(), daemon.jobs.jobs(1).name());
  EXPECT_EQ(FindJob(daemon, "aaaa").value(), daemon.jobs.jobs(0).name());
}

TEST(FindModel, SaysThatTheJobOfAModelWaitsOrRunsAndHowToWaitForIt) {
  for (const std::string& text :
       {std::string("bell"), std::string("aaaaa"), "modalModels/" + std::string(64, 'a')}) {
    EXPECT_THAT(MessageOf(Bell(v1::JOB_STATE_QUEUED), text),
                AllOf(HasSubstr("is queued"), HasSubstr("`carillon job watch aaaaaaaaaaaa`")))
        << text;
    EXPECT_THAT(MessageOf(Bell(v1::JOB_STATE_RUNNING), text), HasSubstr("is running"));
  }
}

TEST(FindModel, SaysNothingOfJobsThatDoNotMakeTheModel) {
  EXPECT_THAT(MessageOf(Bell(v1::JOB_STATE_RUNNING), "bowl"), Not(HasSubstr("job")));
  // The model was made and deleted since.
  EXPECT_THAT(MessageOf(Bell(v1::JOB_STATE_SUCCEEDED), "bell"), Not(HasSubstr("job")));
  // A transfer's job has the model of another job.
  EXPECT_THAT(MessageOf(Bell(v1::JOB_STATE_RUNNING, 'a', 'b'), "bell"), Not(HasSubstr("job")));
}

TEST(FindModel, NamesTheNearestLabel) {
  FakeDaemon daemon;
  daemon.models.add_modal_models()->set_label("bell");
  EXPECT_THAT(FindModel(daemon, "bel").status().ToString(), HasSubstr("did you mean 'bell'?"));
  EXPECT_THAT(FindModel(daemon, "chime").status().ToString(), Not(HasSubstr("did you mean")));
}

}  // namespace
}  // namespace carillon::cli
