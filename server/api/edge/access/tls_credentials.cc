// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/tls_credentials.h"

#include <grpc/grpc.h>

#include <utility>

namespace carillon {

void TlsCredentials::Replace(TlsFiles files) {
  const MutexLock lock(&mutex_);
  if (files == files_) return;
  files_ = std::move(files);
  changed_ = true;
}

int TlsCredentials::AddPortToServer(const std::string& address, grpc_server* server) {
  grpc_ssl_client_certificate_request_type request = GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE;
  {
    const MutexLock lock(&mutex_);
    changed_ = true;  // so that this port fetches the files
    if (!files_.client_roots_pem.empty()) {
      // A certificate is optional, because a client may show a token instead.
      request = GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY;
    }
  }
  grpc_server_credentials* const credentials = grpc_ssl_server_credentials_create_with_options(
      grpc_ssl_server_credentials_create_options_using_config_fetcher(request, Fetch, this));
  if (credentials == nullptr) return 0;
  const int port = grpc_server_add_http2_port(server, address.c_str(), credentials);
  grpc_server_credentials_release(credentials);
  return port;
}

/// gRPC calls this before each handshake.
grpc_ssl_certificate_config_reload_status TlsCredentials::Fetch(
    void* self, grpc_ssl_server_certificate_config** config) {
  auto& credentials = *static_cast<TlsCredentials*>(self);
  const MutexLock lock(&credentials.mutex_);
  if (!std::exchange(credentials.changed_, false)) {
    return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
  }
  const TlsFiles& files = credentials.files_;
  const grpc_ssl_pem_key_cert_pair pair{files.key_pem.c_str(), files.certificate_pem.c_str()};
  // gRPC insists on roots even where clients are not asked for certificates.
  const std::string& roots =
      files.client_roots_pem.empty() ? files.certificate_pem : files.client_roots_pem;
  *config = grpc_ssl_server_certificate_config_create(roots.c_str(), &pair, 1);
  return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
}

}  // namespace carillon
