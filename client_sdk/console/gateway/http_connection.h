// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <memory>
#include <optional>
#include <string>

#include "client_sdk/console/gateway/admission.h"
#include "client_sdk/console/gateway/tunnel.h"

namespace carillon::console {

/// What all connections share.
struct Console {
  Admission admission;
  std::shared_ptr<const Upstream> upstream;
  /// A folder of the user's own pages, which are served below "/pages/"; empty without one.
  std::string pages;
  /// Lasts as long as a tunnel does; its use count, less one, is the number of tunnels.
  std::shared_ptr<int> tunnel_count = std::make_shared<int>();

  static constexpr long kMostTunnels = 16;
};

/// One connection of a browser: answers requests for the pages, and becomes a tunnel at a request
/// for "/tunnel".
///
/// Threading: everything runs on the thread of the stream's executor.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  using Response = boost::beast::http::response<boost::beast::http::string_body>;

  HttpConnection(boost::asio::ip::tcp::socket socket, std::shared_ptr<Console> console)
      : stream_(std::move(socket)), console_(std::move(console)) {}

  /// Reads and answers requests until the connection ends, or waits ten seconds for one in vain.
  void Run();

  /// Returns the answer to a request that is none for a tunnel.
  static Response Answer(const Request& request, const Console& console);

  /// Returns why a request for a tunnel is refused; nothing if it is not.
  static std::optional<Response> TunnelRefusal(const Request& request, const Console& console);

 private:
  void Take(const Request& request);
  void Send(Response response);

  boost::beast::tcp_stream stream_;
  std::shared_ptr<Console> console_;
  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
};

}  // namespace carillon::console
