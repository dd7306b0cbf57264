// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/commands/find_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kDigest(64, 'a');

/// A daemon without models, and with one job, whose model it has yet to make.
class DaemonWithJob : public client::Client {
 public:
  explicit DaemonWithJob(v1::JobState state) {
    job_.set_name("jobs/" + kDigest);
    job_.set_modal_model("modalModels/" + kDigest);
    job_.set_label("bell");
    job_.set_state(state);
    if (state != v1::JOB_STATE_FAILED) return;
    job_.mutable_error()->set_reason("MESH_NOT_CLOSED");
    job_.mutable_error()->set_message("the surface has 12 open edges");
  }

  absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest&) const override {
    return v1::ListModalModelsResponse();
  }
  absl::StatusOr<v1::ModalModelSummary> GetModalModel(const std::string& name) const override {
    return Refusal(absl::StatusCode::kNotFound, "MODAL_MODEL_NOT_FOUND", name);
  }
  absl::StatusOr<v1::ListJobsResponse> ListJobsPage(const v1::ListJobsRequest&) const override {
    v1::ListJobsResponse list;
    *list.add_jobs() = job_;
    if (!other_.name().empty()) *list.add_jobs() = other_;
    return list;
  }

  v1::Job& job() { return job_; }
  v1::Job& other() { return other_; }

 private:
  v1::Job job_, other_;
};

std::string MessageOf(const client::Client& daemon, const std::string& text) {
  const v1::ErrorInfo error = ToErrorInfo(FindModel(daemon, text).status());
  EXPECT_EQ(error.reason(), "MODAL_MODEL_NOT_FOUND");
  return error.message();
}

TEST(FindJob, ALabelMeansTheJobThatHasNotEnded) {
  DaemonWithJob daemon(v1::JOB_STATE_FAILED);
  daemon.other() = daemon.job();
  daemon.other().set_name("jobs/" + std::string(64, 'b'));
  EXPECT_EQ(ToErrorInfo(FindJob(daemon, "bell").status()).reason(), "NAME_AMBIGUOUS");
  daemon.other().set_state(v1::JOB_STATE_QUEUED);
  EXPECT_EQ(FindJob(daemon, "bell").value(), daemon.other().name());
  EXPECT_EQ(FindJob(daemon, "aaaa").value(), daemon.job().name());
}

TEST(FindModel, SaysThatTheJobOfAModelWaitsOrRunsAndHowToWaitForIt) {
  for (const std::string& text :
       {std::string("bell"), kDigest.substr(0, 5), "modalModels/" + kDigest}) {
    EXPECT_THAT(MessageOf(DaemonWithJob(v1::JOB_STATE_QUEUED), text),
                AllOf(HasSubstr("is queued"), HasSubstr("`carillon job watch aaaaaaaaaaaa`"),
                      HasSubstr("`carillon job show aaaaaaaaaaaa`"), HasSubstr("--wait")))
        << text;
    EXPECT_THAT(MessageOf(DaemonWithJob(v1::JOB_STATE_RUNNING), text), HasSubstr("is running"));
  }
}

TEST(FindModel, SaysNothingOfJobsThatDoNotMakeTheModel) {
  EXPECT_THAT(MessageOf(DaemonWithJob(v1::JOB_STATE_RUNNING), "bowl"),
              AllOf(HasSubstr("`carillon model list`"), Not(HasSubstr("job"))));
  // The model was made and deleted since.
  EXPECT_THAT(MessageOf(DaemonWithJob(v1::JOB_STATE_SUCCEEDED), "bell"), Not(HasSubstr("job")));
  DaemonWithJob transfer(v1::JOB_STATE_RUNNING);
  transfer.job().set_modal_model("modalModels/" + std::string(64, 'b'));
  EXPECT_THAT(MessageOf(transfer, "bell"), Not(HasSubstr("job")));
}

/// A daemon with `count` models of the same label.
class DaemonWithModels : public client::Client {
 public:
  explicit DaemonWithModels(int count) {
    for (int i = 0; i < count; ++i) {
      v1::ModalModelSummary& model = *list_.add_modal_models();
      model.set_name("modalModels/" + std::string(64, static_cast<char>('a' + i)));
      model.set_label("bell");
    }
  }
  absl::StatusOr<v1::ListModalModelsResponse> ListModalModelsPage(
      const v1::ListModalModelsRequest&) const override {
    return list_;
  }
  const v1::ModalModelSummary& newest() const { return list_.modal_models(0); }

 private:
  v1::ListModalModelsResponse list_;
};

TEST(FindModel, NamesTheNearestLabel) {
  EXPECT_THAT(std::string(FindModel(DaemonWithModels(2), "bel").status().message()),
              HasSubstr("did you mean 'bell'? `carillon model list`"));
  EXPECT_THAT(std::string(FindModel(DaemonWithModels(2), "chime").status().message()),
              Not(HasSubstr("did you mean")));
}

}  // namespace
}  // namespace carillon::cli
