// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/api/limited_log.h"

namespace carillon {

/// Sends what gRPC itself reports, such as handshakes that fail, to `sink`, within the limits of a
/// LimitedLog. `clock` must outlive the returned object, of which there may be one at a time.
class GrpcLog {
 public:
  GrpcLog(const Clock& clock, LimitedLog::Sink sink);
  ~GrpcLog();
  GrpcLog(const GrpcLog&) = delete;
  GrpcLog& operator=(const GrpcLog&) = delete;

 private:
  LimitedLog log_;
};

}  // namespace carillon
