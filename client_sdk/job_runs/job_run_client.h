// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "carillon/worker/v1/job_run_service.pb.h"

namespace carillon::client {

/// Identifies one run of a decomposition job on a machine of a cluster to the daemon.
struct JobRun {
  std::string job;    ///< "jobs/{digest}"
  std::string token;  ///< the token that the daemon gave to the batch job
};

/// The calls of carillon.worker.v1.JobRunService, for one run. They are private to the daemon and
/// its workers, and so this class is not installed. The errors are those of Client.
class JobRunClient {
 public:
  /// Returns at once, as Connect() does. `options` may lack a token, because the run has its own.
  JobRunClient(const std::string& server, const ConnectOptions& options, JobRun run);
  ~JobRunClient();

  /// Begins the run and writes the mesh of its job to a file.
  /// Further errors: INTERNAL (OUTPUT_NOT_WRITABLE).
  absl::Status FetchMesh(const std::string& file) const;

  /// Tells the daemon how far the run has come. Gives up after 2 seconds, so that the run does not
  /// wait for its own report.
  absl::Status ReportProgress(const v1::Progress& progress) const;

  /// Ends the run. Sends the model or the transfer of `model_file`, in the stored form, unless that
  /// name is empty.
  /// Further errors: NOT_FOUND (FILE_NOT_FOUND), INVALID_ARGUMENT (MODAL_MODEL_MALFORMED).
  absl::Status UploadResult(const worker::v1::RunEnd& end, const std::string& model_file) const;

 private:
  struct Connection;
  const std::unique_ptr<Connection> connection_;
};

}  // namespace carillon::client
