// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/connection_calls.h"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"

namespace carillon {
namespace {

using nlohmann::json;

/// Number of servers or sockets that gRPC lists at a time.
constexpr intptr_t kPageSize = 500;

/// Parses an answer of channelz and frees it. The answer is null if the socket has been closed
/// meanwhile.
json Parse(char* answer) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(answer, &gpr_free);
  return answer == nullptr ? json::object() : json::parse(answer, nullptr, false);
}

/// Returns a number of 64 bits, which is a string in Protobuf's JSON. Zeros are absent there.
uint64_t Number(const json& object, const char* name) {
  uint64_t number = 0;
  const auto found = object.find(name);
  if (found != object.end() && found->is_string()) {
    static_cast<void>(absl::SimpleAtoi(found->get_ref<const std::string&>(), &number));
  }
  return number;
}

/// Returns the peer of a socket, which gRPC names "TRANSPORT PEER".
std::string PeerOf(const json& reference) {
  const std::string name = reference.value("name", "");
  const size_t space = name.find(' ');
  return space == std::string::npos ? name : name.substr(space + 1);
}

void ListOf(intptr_t server, intptr_t first, std::vector<GrpcConnection>& connections) {
  for (;;) {
    const json page = Parse(grpc_channelz_get_server_sockets(server, first, kPageSize));
    const auto sockets = page.find("socketRef");
    if (sockets == page.end() || sockets->empty()) return;
    for (const json& reference : *sockets) {
      first = static_cast<intptr_t>(Number(reference, "socketId"));
      connections.push_back({.id = first, .peer = PeerOf(reference)});
    }
    if (page.value("end", false)) return;
    ++first;
  }
}

}  // namespace

std::vector<GrpcConnection> ListConnections(int64_t first_id) {
  std::vector<GrpcConnection> connections;
  const json answer = Parse(grpc_channelz_get_servers(0));
  const auto servers = answer.find("server");
  if (servers == answer.end()) return connections;
  for (const json& server : *servers) {
    if (!server.contains("ref")) continue;
    const auto id = static_cast<intptr_t>(Number(server["ref"], "serverId"));
    ListOf(id, static_cast<intptr_t>(first_id), connections);
  }
  std::ranges::sort(connections, {}, &GrpcConnection::id);
  return connections;
}

std::optional<ConnectionCalls> ReadConnectionCalls(int64_t id) {
  const json answer = Parse(grpc_channelz_get_socket(static_cast<intptr_t>(id)));
  const auto socket = answer.find("socket");
  if (socket == answer.end() || !socket->contains("data")) return std::nullopt;
  const json& data = (*socket)["data"];
  return ConnectionCalls{.begun_count = Number(data, "streamsStarted"),
                         .answered_count = Number(data, "streamsSucceeded"),
                         .failed_count = Number(data, "streamsFailed"),
                         .message_count = Number(data, "messagesReceived")};
}

}  // namespace carillon
