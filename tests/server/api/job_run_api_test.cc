// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "server/base/sha256.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

using testing::UnorderedElementsAre;

/// A job whose run was given a token, with its folder.
class JobRunApi : public ServedDaemon {
 protected:
  JobRunApi() {
    std::filesystem::create_directories(job_folder);
    WriteBytes(job_folder / "mesh", mesh);
    runs().Admit(digest, job_folder, RemoteRuns::HashOf(digest, token));
  }

  static void Show(const std::string& shown, grpc::ClientContext& context) {
    if (!shown.empty()) context.AddMetadata("authorization", "Bearer " + shown);
  }

  grpc::Status Fetch(const std::string& shown, std::string& bytes) {
    grpc::ClientContext context;
    Show(shown, context);
    worker::v1::FetchMeshRequest request;
    request.set_job("jobs/" + digest);
    const auto reader = job_runs->FetchMesh(&context, request);
    worker::v1::FetchMeshResponse response;
    while (reader->Read(&response)) bytes += response.data();
    return reader->Finish();
  }

  grpc::Status Report(const std::string& shown) {
    grpc::ClientContext context;
    Show(shown, context);
    worker::v1::ReportProgressRequest request;
    request.set_job("jobs/" + digest);
    request.mutable_progress()->set_fraction(0.5);
    worker::v1::ReportProgressResponse response;
    return job_runs->ReportProgress(&context, request, &response);
  }

  /// The first `record_count` records, then the end unless `ends` is false.
  grpc::Status Upload(const std::string& shown, size_t record_count, bool ends = true) {
    grpc::ClientContext context;
    Show(shown, context);
    worker::v1::UploadResultResponse response;
    const auto writer = job_runs->UploadResult(&context, &response);
    worker::v1::UploadResultRequest request;
    request.set_job("jobs/" + digest);
    for (size_t i = 0; i < record_count; ++i) {
      *request.mutable_record() = records[i];
      writer->Write(request);
    }
    request.mutable_end()->set_exit_status(0);
    if (ends) writer->Write(request);
    writer->WritesDone();
    return writer->Finish();
  }

  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(job_folder)) {
      names.push_back(entry.path().filename());
    }
    return names;
  }

  const std::string digest = Sha256Hex("a request");
  const std::string token = RemoteRuns::NewToken();
  const std::string mesh = std::string(3 << 20, 'v');
  const std::filesystem::path job_folder = folder() / digest;
  const std::vector<v1::ModalModelRecord> records = SampleRecords(SampleModel(3, 10));
};

TEST_F(JobRunApi, ARunFetchesItsMeshTellsProgressAndBringsItsModel) {
  std::string bytes;
  EXPECT_TRUE(Fetch(token, bytes).ok());
  EXPECT_EQ(bytes, mesh);
  EXPECT_TRUE(Report(token).ok());
  const grpc::Status status = Upload(token, records.size());
  ASSERT_TRUE(status.ok()) << status.error_message();
  const std::string end = ReadBytes(job_folder / "end");
  const std::string run = end.substr(0, end.find(' '));
  EXPECT_EQ(end, run + " 0\n");
  const auto model = ReadModelFile(job_folder / ("model." + run), digest);
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_EQ(model->shapes, SampleModel(3, 10).shapes);
}

TEST_F(JobRunApi, OnlyTheTokenOfThatJobOpensIt) {
  const std::string other = RemoteRuns::NewToken();
  runs().Admit(Sha256Hex("another"), job_folder, RemoteRuns::HashOf(Sha256Hex("another"), other));
  std::string bytes;
  for (const std::string& shown : {std::string(), std::string("no token"), other}) {
    ExpectRefused(Fetch(shown, bytes), grpc::PERMISSION_DENIED, "JOB_TOKEN_WRONG");
    ExpectRefused(Report(shown), grpc::PERMISSION_DENIED, "JOB_TOKEN_WRONG");
    ExpectRefused(Upload(shown, records.size()), grpc::PERMISSION_DENIED, "JOB_TOKEN_WRONG");
  }
  const std::string logged = log();
  int line_count = 0;
  for (size_t at = logged.find("JOB_TOKEN_WRONG"); at != std::string::npos;
       at = logged.find("JOB_TOKEN_WRONG", at + 1)) {
    ++line_count;
  }
  EXPECT_EQ(line_count, 9) << logged;
  EXPECT_EQ(bytes, "");
  EXPECT_THAT(Files(), UnorderedElementsAre("mesh"));
}

TEST_F(JobRunApi, ATokenBringsOneResult) {
  EXPECT_TRUE(Upload(token, records.size()).ok());
  const std::vector<std::string> files = Files();
  ExpectRefused(Upload(token, records.size()), grpc::FAILED_PRECONDITION, "JOB_TOKEN_EXPIRED");
  EXPECT_THAT(Files(), testing::UnorderedElementsAreArray(files));
}

TEST_F(JobRunApi, ATokenExpiresWithItsSubmissionAndItsJob) {
  runs().Admit(digest, job_folder, RemoteRuns::HashOf(digest, "of the next submission"));
  ExpectRefused(Upload(token, records.size()), grpc::FAILED_PRECONDITION, "JOB_TOKEN_EXPIRED");
  runs().Dismiss(digest);
  ExpectRefused(Upload(token, records.size()), grpc::FAILED_PRECONDITION, "JOB_TOKEN_EXPIRED");
  EXPECT_THAT(Files(), UnorderedElementsAre("mesh"));
}

TEST_F(JobRunApi, OfAPartialResultNothingIsKeptAndItMayBeSentAgain) {
  ExpectRefused(Upload(token, records.size(), false), grpc::INVALID_ARGUMENT, "RESULT_INCOMPLETE");
  ExpectRefused(Upload(token, records.size() - 1), grpc::INVALID_ARGUMENT, "MODAL_MODEL_MALFORMED");
  EXPECT_THAT(Files(), UnorderedElementsAre("mesh"));
  EXPECT_TRUE(Upload(token, records.size()).ok());
}

TEST_F(JobRunApi, AnUploadThatWasBegunBeforeAnotherSubmissionIsRefusedAtItsEnd) {
  absl::StatusOr<RunUpload> upload = runs().BeginUpload(digest, token);
  ASSERT_TRUE(upload.ok());
  for (const v1::ModalModelRecord& record : records) ASSERT_TRUE(upload->Append(record).ok());
  runs().Admit(digest, job_folder, RemoteRuns::HashOf(digest, "of the next submission"));
  EXPECT_THAT(upload->Finish({}).ToString(), testing::HasSubstr("JOB_TOKEN_EXPIRED"));
  EXPECT_FALSE(std::filesystem::exists(job_folder / "end"));
}

}  // namespace
}  // namespace carillon
