// SPDX-License-Identifier: Apache-2.0
//
// WatchJobs, and ListJobs with a filter. Every job of this daemon fails.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

using testing::Contains;
using testing::ElementsAre;

class WatchJobsApi : public ServedDaemon {
 protected:
  using Reader = std::unique_ptr<grpc::ClientReader<v1::WatchJobsResponse>>;

  void Cancel(const std::string& name) {
    v1::CancelJobRequest request;
    request.set_name(name);
    v1::CancelJobResponse response;
    EXPECT_TRUE(Call(*jobs, &v1::DecompositionService::Stub::CancelJob, request, response).ok());
  }

  /// Reads to the job's end; returns all messages with a job.
  static std::vector<v1::Job> ReadToEndOf(const std::string& name, Reader& reader) {
    std::vector<v1::Job> read;
    v1::WatchJobsResponse response;
    while (reader->Read(&response)) {
      if (!response.has_job()) continue;
      read.push_back(response.job());
      if (response.job().name() == name && response.job().state() == v1::JOB_STATE_FAILED) break;
    }
    return read;
  }

  /// Reads the jobs that wait or run.
  static std::vector<std::string> ReadBegin(Reader& reader) {
    std::vector<std::string> names;
    v1::WatchJobsResponse response;
    while (reader->Read(&response) && response.has_job()) names.push_back(response.job().name());
    EXPECT_FALSE(response.has_job());
    return names;
  }

  grpc::ClientContext context_;
};

TEST_F(WatchJobsApi, TellsOfEachJobFromItsBeginToItsEnd) {
  Reader reader = jobs->WatchJobs(&context_, {});
  EXPECT_THAT(ReadBegin(reader), ElementsAre());
  const std::string first = Submit("first").name();
  const std::string second = Submit("second").name();
  const std::vector<v1::Job> read = ReadToEndOf(second, reader);
  for (const std::string& name : {first, second}) {
    int last = v1::JOB_STATE_UNSPECIFIED;
    for (const v1::Job& job : read) {
      if (job.name() == name) last = job.state();
    }
    if (name == second) {
      EXPECT_EQ(last, v1::JOB_STATE_FAILED);
    }
    EXPECT_NE(last, v1::JOB_STATE_UNSPECIFIED) << name;
  }
  EXPECT_NE(read.back().error().reason(), "");
  context_.TryCancel();
  EXPECT_EQ(reader->Finish().error_code(), grpc::CANCELLED);
}

TEST_F(WatchJobsApi, SendsOnlyWhatMatches) {
  v1::WatchJobsRequest request;
  request.add_states(v1::JOB_STATE_FAILED);
  request.set_label_contains("bell");
  Reader reader = jobs->WatchJobs(&context_, request);
  ReadBegin(reader);
  Submit("bowl");
  Submit("BELL one");
  const std::vector<v1::Job> read = ReadToEndOf(Submit("two bells").name(), reader);
  std::vector<std::string> labels;
  for (const v1::Job& job : read) {
    EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
    labels.push_back(job.label());
  }
  EXPECT_THAT(labels, Contains("two bells"));
  EXPECT_THAT(labels, testing::Not(Contains("bowl")));
}

TEST_F(WatchJobsApi, EndsForAWatcherThatDoesNotReadAndForNoOther) {
  constexpr uint32_t kMostWaiting = 4096;
  // The messages that the reader does not read fill the connection's window, which does not grow
  // here.
  constexpr uint32_t kSubmitted = kMostWaiting + 700;
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto stub = v1::DecompositionService::NewStub(
      grpc::CreateCustomChannel(address(), grpc::InsecureChannelCredentials(), arguments));
  v1::CreateModalModelRequest request = RequestFor("a mesh", std::string(200, 'x'));
  Reader reader = stub->WatchJobs(&context_, {});
  for (uint32_t i = 0; i < kSubmitted; ++i) {
    request.mutable_settings()->set_keep_mode_count(1 + i);
    Cancel(Submit(request).name());
  }
  uint32_t read_count = 0;
  v1::WatchJobsResponse response;
  while (read_count < kSubmitted && reader->Read(&response)) ++read_count;
  EXPECT_LT(read_count, kSubmitted);
  const grpc::Status status = reader->Finish();
  EXPECT_EQ(status.error_code(), grpc::DATA_LOSS);
  EXPECT_THAT(status.error_message(), testing::StartsWith("WATCH_TOO_SLOW: "));
  grpc::ClientContext context;
  Reader another = jobs->WatchJobs(&context, {});
  ReadBegin(another);
  const std::string name = Submit("last").name();
  EXPECT_EQ(ReadToEndOf(name, another).back().name(), name);
}

}  // namespace
}  // namespace carillon
