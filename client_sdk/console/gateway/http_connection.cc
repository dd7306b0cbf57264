// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/http_connection.h"

#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>

#include "client_sdk/console/gateway/web_pages.h"

namespace carillon::console {
namespace {

namespace http = boost::beast::http;
using boost::beast::error_code;
using Request = HttpConnection::Request;
using Response = HttpConnection::Response;

constexpr std::chrono::seconds kPatience{10};
constexpr uint32_t kMostHeaderBytes = 8192;
constexpr std::string_view kTokenQuery = "/?token=";

std::string_view Field(const Request& request, http::field field) {
  const auto value = request[field];
  return {value.data(), value.size()};
}

std::string_view Target(const Request& request) {
  return {request.target().data(), request.target().size()};
}

Response Plain(const Request& request, http::status status, const std::string& text) {
  Response response(status, request.version());
  // Every answer, also that of a worker's script, must isolate the page, or the browser gives it no
  // shared memory.
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Embedder-Policy", "require-corp");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Content-Security-Policy",
               "default-src 'none'; script-src 'self'; worker-src 'self'; connect-src 'self'; "
               "style-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'; "
               "base-uri 'none'; form-action 'none'");
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set(http::field::cache_control, "no-cache");
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.keep_alive(request.keep_alive());
  response.body() = text + "\n";
  response.prepare_payload();
  return response;
}

Response PageOf(const Request& request, const WebPage& page) {
  Response response = Plain(request, http::status::ok, "");
  response.set(http::field::content_type, std::string(page.content_type));
  response.set(http::field::content_encoding, "gzip");
  response.body() = page.bytes;
  response.prepare_payload();
  return response;
}

}  // namespace

Response HttpConnection::Answer(const Request& request, const Admission& admission) {
  if (!Admission::IsOwnHost(Field(request, http::field::host))) {
    return Plain(request, http::status::misdirected_request,
                 "the console answers to localhost and 127.0.0.1 only");
  }
  if (request.method() != http::verb::get) {
    return Plain(request, http::status::method_not_allowed, "only GET is served");
  }
  std::string_view target = Target(request);
  if (target.starts_with(kTokenQuery) && admission.IsToken(target.substr(kTokenQuery.size()))) {
    Response response = Plain(request, http::status::see_other, "");
    response.set(http::field::location, "/");
    response.set(http::field::set_cookie, admission.SetCookie());
    return response;
  }
  if (!admission.HasCookie(Field(request, http::field::cookie))) {
    return Plain(request, http::status::unauthorized,
                 "open the address that carillon-console prints, with its token");
  }
  target = target.substr(0, target.find('?'));
  const WebPage* page = FindWebPage(target);
  if (page == nullptr) return Plain(request, http::status::not_found, "there is no such page");
  return PageOf(request, *page);
}

std::optional<Response> HttpConnection::TunnelRefusal(const Request& request,
                                                      const Console& console) {
  const std::string_view host = Field(request, http::field::host);
  if (!Admission::IsOwnHost(host) ||
      !Admission::IsOwnOrigin(Field(request, http::field::origin), host) ||
      !console.admission.HasCookie(Field(request, http::field::cookie))) {
    return Plain(request, http::status::forbidden, "only the console's own page has a tunnel");
  }
  if (console.tunnel_count.use_count() > Console::kMostTunnels) {
    return Plain(request, http::status::service_unavailable,
                 "16 tunnels are open: close other pages of the console");
  }
  return std::nullopt;
}

void HttpConnection::Run() {
  parser_.emplace();
  parser_->header_limit(kMostHeaderBytes);
  parser_->body_limit(0);
  stream_.expires_after(kPatience);
  http::async_read(stream_, buffer_, *parser_,
                   [self = shared_from_this()](error_code error, size_t) {
                     if (!error) self->Take(self->parser_->get());
                   });
}

void HttpConnection::Take(const Request& request) {
  if (!boost::beast::websocket::is_upgrade(request) || Target(request) != "/tunnel") {
    return Send(Answer(request, console_->admission));
  }
  if (auto refusal = TunnelRefusal(request, *console_)) return Send(*std::move(refusal));
  // The deleter holds the count of tunnels up until the tunnel ends.
  std::shared_ptr<Tunnel> tunnel(
      new Tunnel(std::move(stream_), console_->upstream),
      [counted = console_->tunnel_count](const Tunnel* ended) { delete ended; });
  tunnel->Run(request);
}

void HttpConnection::Send(Response response) {
  const auto sent = std::make_shared<Response>(std::move(response));
  http::async_write(stream_, *sent, [self = shared_from_this(), sent](error_code error, size_t) {
    if (!error && sent->keep_alive()) self->Run();
  });
}

}  // namespace carillon::console
