// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/edge.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

absl::Status Unready(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kFailedPrecondition, reason, message);
}

}  // namespace

absl::StatusOr<std::deque<ListenAddress>> Edge::Parse(const EdgeSettings& settings) {
  std::deque<ListenAddress> addresses;
  for (const std::string& text : settings.addresses) {
    ASSIGN_OR_RETURN(ListenAddress address, ParseListenAddress(text));
    if (!address.is_local() && settings.tls.certificate.empty()) {
      return Unready("TLS_REQUIRED",
                     absl::StrCat(text,
                                  " can be reached from the network, and everybody there could use "
                                  "the daemon; give --tls-certificate and --tls-key, or listen on "
                                  "127.0.0.1 or a Unix socket"));
    }
    if (!address.is_local() && !settings.has_access_file) {
      return Unready("ACCESS_FILE_REQUIRED",
                     absl::StrCat(text,
                                  " can be reached from the network; say who may do what there: "
                                  "give --access-file"));
    }
    addresses.push_back(std::move(address));
  }
  return addresses;
}

absl::Status Edge::Check(const EdgeSettings& settings) {
  ASSIGN_OR_RETURN(const std::deque<ListenAddress> addresses, Parse(settings));
  for (const ListenAddress& address : addresses) {
    if (address.is_unix()) RETURN_IF_ERROR(CheckSocket(address.socket_path));
  }
  const bool serves_tls =
      !settings.tls.certificate.empty() && !std::ranges::all_of(addresses, &ListenAddress::is_unix);
  return serves_tls ? ReadTlsFiles(settings.tls).status() : absl::OkStatus();
}

Edge::Edge(EdgeSettings settings, CertificateEnd& certificate_end, LimitedLog& log)
    : settings_(std::move(settings)),
      certificate_end_(certificate_end),
      gate_(RaiseConnectionLimit(), settings_.client_share, &log),
      guard_(gate_, log) {}

Edge::~Edge() { Close(); }

absl::Status Edge::Serve(absl::Span<grpc::Service* const> services,
                         grpc::CallbackGenericService& refusing) {
  ASSIGN_OR_RETURN(std::deque<ListenAddress> parsed, Parse(settings_));
  for (ListenAddress& address : parsed) {
    ASSIGN_OR_RETURN(const std::shared_ptr<grpc::ServerCredentials> credentials,
                     Credentials(address));
    RETURN_IF_ERROR(gate_.Listen(address, servers_.AddTaker(credentials)));
    addresses_.push_back(address.ToString());
  }
  if (servers_.Start(services, refusing)) return absl::OkStatus();
  return Unready("LISTEN_FAILED",
                 "cannot serve: gRPC does not take the TLS files; see the line before");
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> Edge::Credentials(
    const ListenAddress& address) {
  if (address.is_unix() || settings_.tls.certificate.empty()) {
    return grpc::InsecureServerCredentials();
  }
  ASSIGN_OR_RETURN(TlsFiles files, ReadTlsFiles(settings_.tls));
  certificate_end_.Set(files.end_unix_s);
  tls_.push_back(std::make_shared<TlsCredentials>(std::move(files)));
  return tls_.back();
}

absl::StatusOr<TlsFiles> Edge::ReadTls(const TlsPaths& paths) const {
  return tls_.empty() ? TlsFiles() : ReadTlsFiles(paths);
}

void Edge::ReplaceTls(const TlsFiles& files) {
  for (const auto& credentials : tls_) credentials->Replace(files);
  certificate_end_.Set(files.end_unix_s);
}

void Edge::Open(std::function<void()> each_second) {
  each_second_ = std::move(each_second);
  gate_.Open([this] { wake_.release(); });
  watch_ = std::thread([this] { Watch(); });
}

void Edge::Close() {
  closing_ = true;
  wake_.release();
  if (watch_.joinable()) watch_.join();
  gate_.Close();
}

void Edge::Watch() {
  auto next_second = FloodGuard::Clock::now();
  while (!closing_) {
    if (FloodGuard::Clock::now() >= next_second) {
      next_second = FloodGuard::Clock::now() + std::chrono::seconds(1);
      each_second_();
    }
    FloodGuard::Clock::duration pause = next_second - FloodGuard::Clock::now();
    if (!guard_.rests()) pause = std::min(pause, guard_.Look());
    if (!wake_.try_acquire_for(std::max(pause, FloodGuard::Clock::duration::zero()))) continue;
    while (wake_.try_acquire()) {
    }
  }
}

bool Edge::IsOpen(const std::string& connection) const {
  return connection == "unix:" || gate_.IsOpen(connection);
}

}  // namespace carillon
