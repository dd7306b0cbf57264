// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/base/limited_log.h"

namespace carillon {

/// Sends the messages of gRPC and protobuf, such as those about failed handshakes and about text
/// that is not UTF-8, to `sink`, within the limits of a LimitedLog. `clock` must outlive the
/// object. There may be only one GrpcLog at a time.
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
