// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cpp/internal/grpc_client.h"

#include <grpcpp/client_context.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/support/channel_arguments.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/cpp/internal/authorize.h"
#include "client_sdk/cpp/internal/contact_stream_call.h"
#include "client_sdk/cpp/internal/rpc_status.h"
#include "proto/cpp/server_address.h"

namespace carillon::client {
namespace {

std::shared_ptr<grpc::ChannelCredentials> CredentialsFor(const ConnectOptions& options) {
  if (options.tls_roots_pem.empty()) return grpc::InsecureChannelCredentials();
  grpc::SslCredentialsOptions ssl;
  ssl.pem_root_certs = options.tls_roots_pem;
  ssl.pem_cert_chain = options.tls_certificate_pem;
  ssl.pem_private_key = options.tls_key_pem;
  return grpc::SslCredentials(ssl);
}

std::string TokenOf(const ConnectOptions& options) {
  if (!options.token.empty()) return options.token;
  const char* token = std::getenv("CARILLON_TOKEN");
  return token == nullptr ? "" : token;
}

/// Any message, by which a stub sends and receives those of all calls.
using Message = google::protobuf::Message;

}  // namespace

std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server,
                                           const ConnectOptions& options) {
  grpc::ChannelArguments arguments;
  if (IsOnThisMachine(server)) arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return grpc::CreateCustomChannel(server, CredentialsFor(options), arguments);
}

GrpcClient::GrpcClient(const std::string& server, const ConnectOptions& options)
    : stubs_(std::make_shared<Stubs>(server, TokenOf(options), OpenChannel(server, options))) {}

std::unique_ptr<Client> GrpcClient::WithTimeout(std::chrono::milliseconds timeout) const {
  return std::unique_ptr<Client>(new GrpcClient(stubs_, timeout));
}

void GrpcClient::Prepare(grpc::ClientContext& context,
                         std::optional<std::chrono::milliseconds> usual) const {
  Authorize(context, stubs_->server, stubs_->token);
  const auto timeout = timeout_ ? timeout_ : usual;
  if (timeout) context.set_deadline(std::chrono::system_clock::now() + *timeout);
}

absl::Status GrpcClient::Call(absl::string_view method, const Message& request,
                              Message& response) const {
  grpc::ClientContext context;
  Prepare(context, kCallTimeout);
  return CallByPath(absl::StrCat("/carillon.v1.", method), request, response, context);
}

absl::Status GrpcClient::CallByPath(const std::string& path, const Message& request,
                                    Message& response, grpc::ClientContext& context) const {
  grpc::CompletionQueue queue;
  grpc::TemplatedGenericStub<Message, Message> stub(stubs_->channel);
  const auto call = stub.PrepareUnaryCall(&context, path, request, &queue);
  call->StartCall();
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return FromRpc(status, stubs_->server);
}

absl::StatusOr<std::unique_ptr<ContactStream>> GrpcClient::StreamContacts(
    const v1::ContactStreamStart& start) const {
  auto context = std::make_unique<grpc::ClientContext>();
  Prepare(*context);
  return OpenContactStream(stubs_->contacts, stubs_->server, std::move(context), start);
}

}  // namespace carillon::client
