// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpc/grpc_security.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "absl/base/thread_annotations.h"
#include "server/api/edge/access/tls_files.h"
#include "server/base/mutex.h"

namespace carillon {

/// TLS whose certificates can be replaced while connections stay open. Only gRPC's C interface has
/// credentials that can be replaced at a chosen moment; its C++ interface does not. Safe from every
/// thread.
class TlsCredentials final : public grpc::ServerCredentials {
 public:
  explicit TlsCredentials(TlsFiles files) : files_(std::move(files)) {}

  /// Uses these files for new connections. The old and the new files must both have client roots,
  /// or neither.
  void Replace(TlsFiles files);

  /// Does nothing: AccessControl decides about callers.
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override;
  static grpc_ssl_certificate_config_reload_status Fetch(
      void* self, grpc_ssl_server_certificate_config** config);

  Mutex mutex_;
  TlsFiles files_ ABSL_GUARDED_BY(mutex_);
  bool changed_ ABSL_GUARDED_BY(mutex_) = true;
};

}  // namespace carillon
