// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <grpcpp/channel.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "client_sdk/console/gateway/tunnel_call.h"
#include "client_sdk/console/gateway/tunnel_frame.h"

namespace carillon::console {

/// The daemon behind the tunnels.
struct Upstream {
  std::string server;  ///< Its address.
  std::string token;   ///< For a daemon over TCP; empty without one.
};

/// A WebSocket that carries gRPC calls between a browser and the daemon as bytes, in the frames of
/// tunnel_frame.h. It knows no message of the contract, only the services that a page may call
/// (IsServed).
///
/// Messages of the daemon are read only while less than kMostWaitingBytes wait for the socket: a
/// slow browser slows down its calls and, while it listens, loses blocks at the daemon, but takes
/// no memory here.
///
/// Threading: everything but the callbacks of the calls runs on the thread of the stream's
/// executor.
class Tunnel : public std::enable_shared_from_this<Tunnel> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;

  static constexpr size_t kMostCalls = 64;
  static constexpr size_t kMostFrameBytes = (2U << 20U) + 1024;
  static constexpr size_t kMostWaitingBytes = 256U << 10U;

  /// Opens a connection to the daemon, so that a scene that its page has made ends with the page.
  Tunnel(boost::beast::tcp_stream stream, std::shared_ptr<const Upstream> upstream);
  ~Tunnel();
  Tunnel(const Tunnel&) = delete;
  Tunnel& operator=(const Tunnel&) = delete;

  /// Answers the request for a WebSocket, and carries calls until the browser closes it.
  void Run(const Request& request);

  /// Whether pages may call `method` ("/package.Service/Method"). AdminService and the workers'
  /// calls are not served.
  static bool IsServed(const std::string& method);

 private:
  void Read();
  void Take(const TunnelFrame& frame);
  void Open(uint32_t number, const std::string& method);
  void Queue(std::string frame);
  void Write();
  void OnMessage(uint32_t number, std::string bytes);
  void OnEnd(uint32_t number, const grpc::Status& status);
  void CancelCalls();
  /// Whether more bytes wait for the daemon, or answers for a browser that goes on asking, than a
  /// message or two may have.
  bool IsBehind() const;

  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::asio::steady_timer timer_;
  std::shared_ptr<const Upstream> upstream_;
  std::shared_ptr<grpc::Channel> channel_;
  boost::beast::flat_buffer buffer_;
  std::map<uint32_t, std::shared_ptr<TunnelCall>> calls_;
  std::set<uint32_t> paused_;
  std::deque<std::string> outgoing_;
  size_t waiting_bytes_ = 0;
};

}  // namespace carillon::console
