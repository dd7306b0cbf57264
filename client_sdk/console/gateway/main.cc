// SPDX-License-Identifier: Apache-2.0
//
// carillon-console: serves the console's page to a browser of this machine, and carries the page's
// calls to the daemon.
#include <sched.h>

#include <CLI/CLI.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <string>

#include "client_sdk/console/gateway/http_connection.h"
#include "client_sdk/console/gateway/web_pages.h"
#include "proto/cpp/server_address.h"

namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using carillon::console::Console;
using carillon::console::HttpConnection;
using carillon::console::Upstream;

void Accept(tcp::acceptor& acceptor, const std::shared_ptr<Console>& console) {
  acceptor.async_accept([&acceptor, console](boost::system::error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      // A block of sound must not wait for the browser's acknowledgement of the one before, which
      // may take 40 ms.
      socket.set_option(tcp::no_delay(true), error);
      std::make_shared<HttpConnection>(std::move(socket), console)->Run();
    }
    Accept(acceptor, console);
  });
}

/// Lets this thread and those that it begins run before programs that do not wait for sound: the
/// page plays a block 10 ms after the daemon has rendered it. Without the right to a real-time
/// priority a busy machine may be heard.
void RunBeforeOthers() {
  sched_param parameters{};
  parameters.sched_priority = 7;  // below the threads of the daemon
  sched_setscheduler(0, SCHED_FIFO, &parameters);
}

int Serve(const std::string& server, uint16_t port, const std::string& pages) {
  RunBeforeOthers();
  asio::io_context context(1);
  tcp::acceptor acceptor(context);
  const tcp::endpoint wanted(asio::ip::address_v4::loopback(), port);
  boost::system::error_code error;
  acceptor.open(wanted.protocol());
  acceptor.set_option(tcp::acceptor::reuse_address(true));
  acceptor.bind(wanted, error);
  if (!error) acceptor.listen(tcp::acceptor::max_listen_connections, error);
  if (error) {
    std::cerr << "carillon-console: port " << port << " of 127.0.0.1: " << error.message()
              << "; name another with --port, or 0 for any\n";
    return 1;
  }
  port = acceptor.local_endpoint().port();
  const char* token = std::getenv("CARILLON_TOKEN");
  const auto upstream = std::make_shared<Upstream>();
  upstream->server = server;
  upstream->token = token == nullptr ? "" : token;
  const auto console = std::make_shared<Console>(Console{
      .admission = carillon::console::Admission(port), .upstream = upstream, .pages = pages});
  Accept(acceptor, console);
  asio::signal_set signals(context, SIGINT, SIGTERM);
  signals.async_wait([&](boost::system::error_code, int) { context.stop(); });
  std::cout << "http://127.0.0.1:" << port << "/?token=" << console->admission.token() << std::endl;
  context.run();
  // Calls that are under way end on gRPC's threads and tell `context` so, which must not be gone by
  // then: the process ends without taking it down.
  std::quick_exit(0);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Serves the console, a page that shows and strikes models and hears the daemon, to browsers "
      "of this machine.\n"
      "From another machine: ssh -L 8700:127.0.0.1:8700 HOST.");
  std::string server = carillon::DefaultServerAddress();
  uint16_t port = 8700;
  app.add_option("--server", server, "The address of the daemon")->capture_default_str();
  app.add_option("--port", port, "The port of 127.0.0.1 to listen at; 0 takes any")
      ->capture_default_str();
  std::string pages;
  app.add_option("--pages", pages, "A folder of your own pages, which are served below /pages/")
      ->check(CLI::ExistingDirectory);
  app.add_flag_callback(
      "--trace-page",
      [] {
        std::cout << carillon::console::TracePage();
        throw CLI::Success();
      },
      "Print the page into which `carillon render --html` puts a trace");
  app.set_version_flag("--version", CARILLON_VERSION);
  CLI11_PARSE(app, argc, argv);
  return Serve(server, port, pages);
}
