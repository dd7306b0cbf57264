// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "server/api/edge/access/access_table.h"
#include "server/api/edge/access/guess_limiter.h"
#include "server/base/clock.h"
#include "server/base/limited_log.h"
#include "server/base/mutex.h"

namespace carillon {

/// Decides which calls each caller may make. Callers through a Unix socket have every role. Callers
/// over TCP have the roles that the table gives to their token or certificate. Refusals are logged.
/// Safe from every thread.
class AccessControl {
 public:
  /// `clock` must outlive this.
  AccessControl(AccessTable table, const Clock& clock, LimitedLog::Sink log);

  /// Replaces the table. Running calls go on.
  void Replace(AccessTable table);

  /// Returns the caller if it has the role. Errors: Unauthenticated (CREDENTIAL_MISSING,
  /// TOKEN_WRONG), PermissionDenied (ROLE_MISSING), ResourceExhausted (TOO_MANY_FAILURES).
  /// `function` is the function that serves the call (CallName).
  absl::StatusOr<Principal> Admit(const grpc::CallbackServerContext& context, Role role,
                                  const char* function = __builtin_FUNCTION());

  /// Logs that the call which `function` serves was refused for `status`, and returns `status`.
  absl::Status Refuse(const grpc::CallbackServerContext& context, const char* function,
                      absl::Status status);

 private:
  absl::StatusOr<Principal> Identify(const grpc::CallbackServerContext& context);
  std::shared_ptr<const AccessTable> table() const;
  std::string ClientOf(const Principal& caller) const;

  mutable Mutex mutex_;
  std::shared_ptr<const AccessTable> table_ ABSL_GUARDED_BY(mutex_);
  GuessLimiter guesses_;
  LimitedLog log_;
};

}  // namespace carillon
