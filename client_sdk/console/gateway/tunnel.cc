// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/tunnel.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/websocket/option.hpp>
#include <chrono>
#include <utility>

#include "absl/strings/match.h"
#include "client_sdk/cpp/internal/grpc_client.h"

namespace carillon::console {
namespace {

namespace websocket = boost::beast::websocket;
using boost::beast::error_code;

constexpr const char* kServed[] = {
    "/carillon.v1.AudioService/",  "/carillon.v1.ContactService/",
    "/carillon.v1.SceneService/",  "/carillon.v1.DecompositionService/",
    "/carillon.v1.ServerService/", "/carillon.v1.ModalModelService/",
    "/grpc.health.v1.Health/",
};

/// How long the reading of a socket rests while one of the two sides is behind.
constexpr std::chrono::milliseconds kRest{5};

}  // namespace

Tunnel::Tunnel(boost::beast::tcp_stream stream, std::shared_ptr<const Upstream> upstream)
    : socket_(std::move(stream)),
      timer_(socket_.get_executor()),
      upstream_(std::move(upstream)),
      channel_(client::OpenChannel(upstream_->server, {}, true)) {}

Tunnel::~Tunnel() { CancelCalls(); }

bool Tunnel::IsServed(const std::string& method) {
  for (const char* service : kServed) {
    if (absl::StartsWith(method, service)) return true;
  }
  return false;
}

void Tunnel::Run(const Request& request) {
  boost::beast::get_lowest_layer(socket_).expires_never();
  socket_.set_option(websocket::stream_base::timeout::suggested(boost::beast::role_type::server));
  socket_.read_message_max(kMostFrameBytes);
  socket_.binary(true);
  socket_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (!error) self->Read();
  });
}

void Tunnel::Read() {
  if (IsBehind()) {
    timer_.expires_after(kRest);
    timer_.async_wait([self = shared_from_this()](error_code) { self->Read(); });
    return;
  }
  socket_.async_read(buffer_, [self = shared_from_this()](error_code error, size_t) {
    if (error) return self->CancelCalls();
    const auto bytes = self->buffer_.cdata();
    const auto frame = ParseFrame({static_cast<const char*>(bytes.data()), bytes.size()});
    if (!frame) {
      self->CancelCalls();
      self->socket_.async_close(websocket::close_code::protocol_error, [self](error_code) {});
      return;
    }
    self->Take(*frame);
    self->buffer_.consume(self->buffer_.size());
    self->Read();
  });
}

void Tunnel::Take(const TunnelFrame& frame) {
  if (frame.kind == FrameKind::kOpen) return Open(frame.call, std::string(frame.body));
  // A frame may cross the end of its call on the way.
  const auto found = calls_.find(frame.call);
  if (found == calls_.end()) return;
  switch (frame.kind) {
    case FrameKind::kMessage:
      return found->second->Send(frame.body);
    case FrameKind::kHalfClose:
      return found->second->HalfClose();
    default:
      return found->second->Cancel();
  }
}

void Tunnel::Open(uint32_t number, const std::string& method) {
  if (calls_.contains(number)) {
    return Queue(
        EndFrame(number, {grpc::StatusCode::INVALID_ARGUMENT, "the call is open already"}));
  }
  if (calls_.size() >= kMostCalls) {
    return Queue(EndFrame(number, {grpc::StatusCode::RESOURCE_EXHAUSTED,
                                   "a tunnel has 64 calls at most: end others, or open another"}));
  }
  if (!IsServed(method)) {
    return Queue(EndFrame(number, {grpc::StatusCode::PERMISSION_DENIED,
                                   "the console does not serve " + method.substr(0, 100)}));
  }
  // gRPC calls back on its own threads, and may do so after this tunnel has gone.
  const auto executor = socket_.get_executor();
  const std::weak_ptr<Tunnel> tunnel = weak_from_this();
  TunnelCall::Callbacks callbacks;
  callbacks.on_message = [=](std::string bytes) {
    boost::asio::post(executor, [=, bytes = std::move(bytes)]() mutable {
      if (const auto self = tunnel.lock()) self->OnMessage(number, std::move(bytes));
    });
  };
  callbacks.on_end = [=](const grpc::Status& status, std::shared_ptr<TunnelCall> ended) {
    boost::asio::post(executor, [=, ended = std::move(ended)] {
      if (const auto self = tunnel.lock()) self->OnEnd(number, status);
    });
  };
  calls_[number] = TunnelCall::Start(channel_, method, upstream_->token, callbacks);
}

void Tunnel::OnMessage(uint32_t number, std::string bytes) {
  Queue(FrameHead(FrameKind::kMessage, number) + bytes);
  if (waiting_bytes_ > kMostWaitingBytes) {
    paused_.insert(number);
  } else if (const auto found = calls_.find(number); found != calls_.end()) {
    found->second->ReadNext();
  }
}

void Tunnel::OnEnd(uint32_t number, const grpc::Status& status) {
  calls_.erase(number);
  paused_.erase(number);
  Queue(EndFrame(number, status));
}

void Tunnel::Queue(std::string frame) {
  waiting_bytes_ += frame.size();
  outgoing_.push_back(std::move(frame));
  if (outgoing_.size() == 1) Write();
}

void Tunnel::Write() {
  socket_.async_write(boost::asio::buffer(outgoing_.front()),
                      [self = shared_from_this()](error_code error, size_t) {
                        if (error) return self->CancelCalls();
                        self->waiting_bytes_ -= self->outgoing_.front().size();
                        self->outgoing_.pop_front();
                        if (self->waiting_bytes_ <= kMostWaitingBytes / 4) {
                          for (const uint32_t number : std::exchange(self->paused_, {})) {
                            self->calls_.at(number)->ReadNext();
                          }
                        }
                        if (!self->outgoing_.empty()) self->Write();
                      });
}

void Tunnel::CancelCalls() {
  for (const auto& [number, call] : calls_) call->Cancel();
}

bool Tunnel::IsBehind() const {
  size_t bytes = 0;
  for (const auto& [number, call] : calls_) bytes += call->WaitingBytes();
  return bytes > kMostFrameBytes || waiting_bytes_ > 2 * kMostFrameBytes;
}

}  // namespace carillon::console
