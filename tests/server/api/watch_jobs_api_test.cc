// SPDX-License-Identifier: Apache-2.0
//
// WatchJobs, and ListJobs with a filter. The jobs of this daemon fail or wait.
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class WatchJobsApi : public ServedDaemon {
 protected:
  explicit WatchJobsApi(bool worker_sleeps = false)
      : ServedDaemon({.client_share = 1}, {}, worker_sleeps) {}

  using Reader = std::unique_ptr<grpc::ClientReader<v1::WatchJobsResponse>>;

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
  static void ReadBegin(Reader& reader) {
    v1::WatchJobsResponse response;
    while (reader->Read(&response) && response.has_job()) {
    }
    EXPECT_FALSE(response.has_job());
  }

  grpc::ClientContext context_;
};

TEST_F(WatchJobsApi, SendsOnlyWhatMatches) {
  v1::WatchJobsRequest request;
  request.add_states(v1::JOB_STATE_FAILED);
  request.set_label_contains("bell");
  Reader reader = jobs->WatchJobs(&context_, request);
  ReadBegin(reader);
  Submit("bowl");
  Submit("BELL one");
  const std::vector<v1::Job> read = ReadToEndOf(Submit("two bells").name(), reader);
  for (const v1::Job& job : read) {
    EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED);
    EXPECT_NE(job.label(), "bowl");
  }
  EXPECT_EQ(read.back().label(), "two bells");
}

class WatchWaitingJobsApi : public WatchJobsApi {
 protected:
  WatchWaitingJobsApi() : WatchJobsApi(true) {}
};

TEST_F(WatchWaitingJobsApi, EndsForAWatcherThatDoesNotReadAndForNoOther) {
  constexpr uint32_t kMostWaiting = 4096;
  // The messages that the reader does not read fill the connection's window, which does not grow
  // here.
  constexpr uint32_t kSubmitted = kMostWaiting + 700;
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto stub = v1::DecompositionService::NewStub(
      grpc::CreateCustomChannel(address_, grpc::InsecureChannelCredentials(), arguments));
  v1::CreateModalModelRequest request = RequestFor("a mesh", std::string(200, 'x'));
  Submit("the job for which all others wait");
  Reader reader = stub->WatchJobs(&context_, {});
  for (uint32_t i = 0; i < kSubmitted; ++i) {
    request.mutable_settings()->set_keep_mode_count(1 + i);
    const std::string name = Submit(request).name();
    Called(*jobs, &JobStub::CancelJob, Named<v1::CancelJobRequest>(name));
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
  while (response.job().name() != name && another->Read(&response)) {
  }
  EXPECT_EQ(response.job().name(), name);
}

}  // namespace
}  // namespace carillon
