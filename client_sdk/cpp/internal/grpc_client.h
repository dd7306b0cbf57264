// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "carillon/client.h"
#include "carillon/v1/admin_service.grpc.pb.h"
#include "carillon/v1/audio_service.grpc.pb.h"
#include "carillon/v1/contact_service.grpc.pb.h"
#include "carillon/v1/decomposition_service.grpc.pb.h"
#include "carillon/v1/modal_model_service.grpc.pb.h"

namespace carillon::client {

/// The time limit of a call with one answer. It is far above the time of any such call; the slowest
/// call reads a large model from the disk.
inline constexpr auto kCallTimeout = std::chrono::seconds(60);
/// The time limit of a call for the daemon's health. The daemon answers it at once, because gRPC
/// answers for it.
inline constexpr auto kHealthTimeout = std::chrono::seconds(10);

/// Opens the connection to a daemon. $http_proxy is for other machines: a proxy could not reach
/// this one's loopback addresses. A channel that is `alone` shares its connection with no other
/// channel of the process, so that what it holds at the daemon ends with it.
std::shared_ptr<grpc::Channel> OpenChannel(const std::string& server, const ConnectOptions& options,
                                           bool alone = false);

/// The client that talks to a daemon: one gRPC channel, and one stub for each service with streams.
class GrpcClient final : public Client {
 public:
  GrpcClient(const std::string& server, const ConnectOptions& options);

  std::unique_ptr<Client> WithTimeout(std::chrono::milliseconds timeout) const override;

  absl::StatusOr<bool> IsServing(const std::string& service) const override;

  absl::StatusOr<std::string> UploadMesh(absl::string_view bytes) const override;
  absl::Status ExportModalModel(const std::string& name, const RecordSink& sink) const override;
  absl::StatusOr<v1::ModalModelSummary> ImportModalModel(
      const std::function<absl::Status(const RecordSink&)>& send, const std::string& name,
      const std::string& label) const override;

  absl::StatusOr<v1::Job> WatchJob(
      const std::string& name, const std::function<void(const v1::Job&)>& on_change) const override;
  absl::Status WatchJobs(
      const v1::WatchJobsRequest& request,
      const std::function<bool(const v1::WatchJobsResponse&)>& on_answer) const override;

  absl::StatusOr<std::unique_ptr<ContactStream>> StreamContacts(
      const v1::ContactStreamStart& start) const override;
  absl::Status RecordContacts(
      const std::string& scene, const std::function<void()>& on_begun,
      const std::function<bool(const v1::ContactTraceRecord&)>& on_record) const override;

  absl::Status Listen(const v1::ListenRequest& request,
                      const AudioCallback& on_block) const override;
  absl::StatusOr<v1::RenderSummary> Render(
      const v1::RenderSettings& settings, ContactTraceReader& trace, const AudioCallback& on_block,
      const std::function<void(const v1::Blow&)>& on_blow) const override;

  absl::StatusOr<std::unique_ptr<Performance>> Perform(
      const v1::PerformSettings& settings) const override;

  absl::Status BackUpDatabase(const std::string& file) const override;

 protected:
  absl::Status Call(absl::string_view method, const google::protobuf::Message& request,
                    google::protobuf::Message& response) const override;

 private:
  struct Stubs {
    Stubs(std::string address, std::string shown_token, std::shared_ptr<grpc::Channel> opened)
        : server(std::move(address)),
          token(std::move(shown_token)),
          channel(std::move(opened)),
          models(channel),
          decompositions(channel),
          contacts(channel),
          audio(channel),
          admin(channel) {}

    const std::string server;
    const std::string token;
    const std::shared_ptr<grpc::Channel> channel;
    v1::ModalModelService::Stub models;
    v1::DecompositionService::Stub decompositions;
    v1::ContactService::Stub contacts;
    v1::AudioService::Stub audio;
    v1::AdminService::Stub admin;
  };

  GrpcClient(std::shared_ptr<Stubs> stubs, std::chrono::milliseconds timeout)
      : stubs_(std::move(stubs)), timeout_(timeout) {}

  /// Gives a call its token, and its deadline if it has one. `usual` is the deadline of a client
  /// without a timeout.
  void Prepare(grpc::ClientContext& context,
               std::optional<std::chrono::milliseconds> usual = std::nullopt) const;

  /// Makes a call with one answer by its full name on the wire.
  absl::Status CallByPath(const std::string& path, const google::protobuf::Message& request,
                          google::protobuf::Message& response, grpc::ClientContext& context) const;

  // gRPC's stubs take their calls as changes, which the calls of a client are not.
  const std::shared_ptr<Stubs> stubs_;
  const std::optional<std::chrono::milliseconds> timeout_;
};

}  // namespace carillon::client
