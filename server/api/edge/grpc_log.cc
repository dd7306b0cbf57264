// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/grpc_log.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>

#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_cat.h"
#include "server/base/mutex.h"

namespace carillon {
namespace {

Mutex log_mutex;
LimitedLog* present_log ABSL_GUARDED_BY(log_mutex) = nullptr;

void Warn(const std::string& text) {
  const MutexLock lock(&log_mutex);
  if (present_log != nullptr) present_log->Warn(text);
}

void LogGrpc(gpr_log_func_args* message) {
  if (message->severity != GPR_LOG_SEVERITY_ERROR) return;
  Warn(absl::StrCat("gRPC: ", message->message));
}

void LogProtobuf(google::protobuf::LogLevel level, const char* /*file*/, int /*line*/,
                 const std::string& message) {
  if (level < google::protobuf::LOGLEVEL_ERROR) return;
  Warn(absl::StrCat("protobuf: ", message));
}

}  // namespace

GrpcLog::GrpcLog(const Clock& clock, LimitedLog::Sink sink) : log_(clock, "gRPC", std::move(sink)) {
  const MutexLock lock(&log_mutex);
  present_log = &log_;
  gpr_set_log_function(LogGrpc);
  google::protobuf::SetLogHandler(LogProtobuf);
}

GrpcLog::~GrpcLog() {
  const MutexLock lock(&log_mutex);
  present_log = nullptr;
}

}  // namespace carillon
