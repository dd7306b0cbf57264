// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/http_connection.h"

#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <system_error>
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
constexpr std::string_view kScriptType = "text/javascript; charset=utf-8";
constexpr std::string_view kTokenQuery = "?token=";
constexpr std::string_view kOwnPages = "/pages/";

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

std::string TypeOf(const std::filesystem::path& file) {
  constexpr std::pair<std::string_view, std::string_view> kTypes[] = {
      {".html", "text/html; charset=utf-8"},
      {".js", kScriptType},
      {".mjs", kScriptType},
      {".css", "text/css; charset=utf-8"},
      {".json", "application/json"},
      {".wasm", "application/wasm"},
      {".png", "image/png"},
      {".svg", "image/svg+xml"},
  };
  for (const auto& [suffix, type] : kTypes) {
    if (file.extension() == suffix) return std::string(type);
  }
  return "application/octet-stream";
}

/// Returns a file of the user's own pages; nothing if there is none of that name. Such a page may
/// do what its author wants, but is as isolated from other pages as the console's own.
std::optional<Response> OwnPageOf(const Request& request, const std::string& folder,
                                  std::string_view name) {
  std::error_code error;
  const std::filesystem::path root = std::filesystem::canonical(folder, error);
  if (folder.empty() || error) return std::nullopt;
  const std::filesystem::path file =
      std::filesystem::canonical(root / (name.empty() ? "index.html" : std::string(name)), error);
  // A link or ".." must not lead out of the folder.
  if (error || !std::filesystem::is_regular_file(file, error) ||
      !file.string().starts_with(root.string() + "/")) {
    return std::nullopt;
  }
  std::ifstream stream(file, std::ios::binary);
  Response response = Plain(request, http::status::ok, "");
  response.set(
      "Content-Security-Policy",
      "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; "
      "style-src 'self' 'unsafe-inline'; frame-ancestors 'none'");
  response.set(http::field::content_type, TypeOf(file));
  response.body() = std::string(std::istreambuf_iterator<char>(stream), {});
  response.prepare_payload();
  return response;
}

}  // namespace

Response HttpConnection::Answer(const Request& request, const Console& console) {
  if (!Admission::IsOwnHost(Field(request, http::field::host))) {
    return Plain(request, http::status::misdirected_request,
                 "the console answers to localhost and 127.0.0.1 only");
  }
  if (request.method() != http::verb::get) {
    return Plain(request, http::status::method_not_allowed, "only GET is served");
  }
  const std::string_view target = Target(request);
  const std::string_view path = target.substr(0, target.find('?'));
  const std::string_view query = target.substr(path.size());
  if ((path == "/" || path.starts_with(kOwnPages)) && query.starts_with(kTokenQuery) &&
      console.admission.IsToken(query.substr(kTokenQuery.size()))) {
    Response response = Plain(request, http::status::see_other, "");
    response.set(http::field::location, std::string(path));
    response.set(http::field::set_cookie, console.admission.SetCookie());
    return response;
  }
  if (!console.admission.HasCookie(Field(request, http::field::cookie))) {
    return Plain(request, http::status::unauthorized,
                 "open the address that carillon-console prints, with its token");
  }
  if (path.starts_with(kOwnPages)) {
    if (auto file = OwnPageOf(request, console.pages, path.substr(kOwnPages.size()))) return *file;
  }
  const WebPage* page = FindWebPage(path);
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
    return Send(Answer(request, *console_));
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
