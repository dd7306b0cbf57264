// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"

namespace carillon {

/// The PEM files for TCP addresses.
struct TlsPaths {
  std::string certificate;  ///< no TLS if empty
  std::string key;
  std::string client_roots;  ///< if empty, clients are not asked for certificates

  bool operator==(const TlsPaths&) const = default;
};

/// The content of the PEM files.
struct TlsFiles {
  std::string certificate_pem;
  std::string key_pem;
  std::string client_roots_pem;
  int64_t end_unix_s = 0;  ///< time at which the first certificate expires

  bool operator==(const TlsFiles&) const = default;
};

/// Reads and checks the files. Errors: FailedPrecondition (TLS_UNUSABLE: a file cannot be read, is
/// not PEM, the certificate has expired or is not valid yet, the key does not belong to the
/// certificate, or others may read or change the key).
absl::StatusOr<TlsFiles> ReadTlsFiles(const TlsPaths& paths);

}  // namespace carillon
