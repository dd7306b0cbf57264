// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/tls_files.h"

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <algorithm>
#include <ctime>
#include <memory>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/edge/access/private_file.h"

namespace carillon {
namespace {

constexpr char kReason[] = "TLS_UNUSABLE";

using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Bytes = std::unique_ptr<BIO, decltype(&BIO_free)>;

absl::Status Unusable(const std::string& path, absl::string_view why) {
  ERR_clear_error();
  return Refusal(absl::StatusCode::kFailedPrecondition, kReason,
                 absl::StrCat("\"", path, "\" ", why));
}

Bytes BytesOf(const std::string& pem) {
  return {BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), BIO_free};
}

/// Returns a time in the form "Nov 22 13:30:00 2026 GMT".
std::string TextOf(const ASN1_TIME* moment) {
  const Bytes text(BIO_new(BIO_s_mem()), BIO_free);
  ASN1_TIME_print(text.get(), moment);
  const char* data = nullptr;
  const auto size = static_cast<size_t>(BIO_get_mem_data(text.get(), &data));
  return {data, size};
}

int64_t EndOf(const X509& certificate) {
  std::tm end{};
  ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &end);
  return timegm(&end);
}

absl::StatusOr<Certificate> ReadCertificate(const std::string& pem, const std::string& path) {
  Certificate certificate(PEM_read_bio_X509(BytesOf(pem).get(), nullptr, nullptr, nullptr),
                          X509_free);
  if (certificate == nullptr) return Unusable(path, "holds no certificate: give a PEM file");
  const ASN1_TIME* const end = X509_get0_notAfter(certificate.get());
  const ASN1_TIME* const begin = X509_get0_notBefore(certificate.get());
  if (X509_cmp_current_time(end) <= 0) {
    return Unusable(path, absl::StrCat("expired on ", TextOf(end), ": get a new certificate"));
  }
  if (X509_cmp_current_time(begin) > 0) {
    return Unusable(path, absl::StrCat("is valid from ", TextOf(begin),
                                       " only: check the clock, or get another certificate"));
  }
  return certificate;
}

/// Refuses an encrypted key, because the daemon cannot ask for its password.
int NoPassword(char*, int, int, void*) { return 0; }

absl::Status CheckKey(const TlsFiles& files, const TlsPaths& paths, X509& certificate) {
  const Key key(PEM_read_bio_PrivateKey(BytesOf(files.key_pem).get(), nullptr, NoPassword, nullptr),
                EVP_PKEY_free);
  if (key == nullptr) {
    return Unusable(paths.key, "holds no private key: give a PEM file without a password");
  }
  if (X509_check_private_key(&certificate, key.get()) == 1) return absl::OkStatus();
  return Unusable(paths.key,
                  absl::StrCat("is not the key of the certificate in \"", paths.certificate,
                               "\": give the two that were made "
                               "together"));
}

}  // namespace

absl::StatusOr<TlsFiles> ReadTlsFiles(const TlsPaths& paths) {
  TlsFiles files;
  ASSIGN_OR_RETURN(files.certificate_pem, ReadPublicFile(paths.certificate, kReason));
  ASSIGN_OR_RETURN(files.key_pem, ReadPrivateFile(paths.key, kReason));
  ASSIGN_OR_RETURN(const Certificate certificate,
                   ReadCertificate(files.certificate_pem, paths.certificate));
  RETURN_IF_ERROR(CheckKey(files, paths, *certificate));
  files.end_unix_s = EndOf(*certificate);
  if (paths.client_roots.empty()) return files;
  ASSIGN_OR_RETURN(files.client_roots_pem, ReadPublicFile(paths.client_roots, kReason));
  ASSIGN_OR_RETURN(const Certificate roots,
                   ReadCertificate(files.client_roots_pem, paths.client_roots));
  files.end_unix_s = std::min(files.end_unix_s, EndOf(*roots));
  return files;
}

}  // namespace carillon
