// SPDX-License-Identifier: Apache-2.0
#include "server/api/connection_calls.h"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"

namespace carillon {
namespace {

using nlohmann::json;

/// Servers or sockets that gRPC names at a time.
constexpr intptr_t kPageSize = 500;

/// Parses an answer of channelz and frees it. An answer to a socket that has been closed meanwhile
/// is null.
json Parse(char* answer) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(answer, &gpr_free);
  return answer == nullptr ? json::object() : json::parse(answer, nullptr, false);
}

/// Numbers of 64 bits are strings in the JSON of Protobuf; zeros are left out.
uint64_t Number(const json& object, const char* name) {
  uint64_t number = 0;
  const auto found = object.find(name);
  if (found != object.end() && found->is_string()) {
    static_cast<void>(absl::SimpleAtoi(found->get_ref<const std::string&>(), &number));
  }
  return number;
}

/// gRPC names a socket "TRANSPORT PEER".
std::string PeerOf(const json& reference) {
  const std::string name = reference.value("name", "");
  const size_t space = name.find(' ');
  return space == std::string::npos ? name : name.substr(space + 1);
}

void ReadSocket(const json& reference, std::map<std::string, ConnectionCalls>& calls) {
  const auto id = static_cast<intptr_t>(Number(reference, "socketId"));
  const json answer = Parse(grpc_channelz_get_socket(id));
  const auto socket = answer.find("socket");
  if (socket == answer.end() || !socket->contains("data")) return;
  const json& data = (*socket)["data"];
  calls[PeerOf(reference)] = {.begun_count = Number(data, "streamsStarted"),
                              .answered_count = Number(data, "streamsSucceeded"),
                              .failed_count = Number(data, "streamsFailed")};
}

void ReadServer(intptr_t server, std::map<std::string, ConnectionCalls>& calls) {
  for (intptr_t first = 0;;) {
    const json page = Parse(grpc_channelz_get_server_sockets(server, first, kPageSize));
    const auto sockets = page.find("socketRef");
    if (sockets == page.end() || sockets->empty()) return;
    for (const json& reference : *sockets) ReadSocket(reference, calls);
    if (page.value("end", false)) return;
    first = static_cast<intptr_t>(Number(sockets->back(), "socketId")) + 1;
  }
}

}  // namespace

std::map<std::string, ConnectionCalls> ReadConnectionCalls() {
  std::map<std::string, ConnectionCalls> calls;
  const json answer = Parse(grpc_channelz_get_servers(0));
  const auto servers = answer.find("server");
  if (servers == answer.end()) return calls;
  for (const json& server : *servers) {
    if (!server.contains("ref")) continue;
    ReadServer(static_cast<intptr_t>(Number(server["ref"], "serverId")), calls);
  }
  return calls;
}

}  // namespace carillon
