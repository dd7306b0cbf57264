// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/connection_gate.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/api/edge/listen_address.h"
#include "server/base/clock.h"
#include "server/base/limited_log.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

/// Keeps connections open until it is told to close them.
class Keeper final : public ConnectionTaker {
 public:
  explicit Keeper(std::counting_semaphore<>& taken) : taken_(taken) {}
  void Take(int connection, const std::string& /*source*/) override {
    newest = connection;
    taken_.release();
  }
  void Refuse(int connection) override {
    refused = connection;
    refused_.release();
  }
  /// Waits for a connection without a place, and closes it.
  void CloseRefused() {
    refused_.acquire();
    shutdown(refused, SHUT_RDWR);
    close(refused);
  }
  int newest = -1;
  int refused = -1;

 private:
  std::counting_semaphore<>& taken_;
  std::counting_semaphore<> refused_{0};
};

/// Takes each address of this machine for an address of its own.
std::string AddressWithoutPort(const std::string& peer) {
  return peer.starts_with("unix:") ? SourceOfPeer(peer) : peer.substr(0, peer.rfind(':'));
}

class ConnectionGateTest : public testing::Test {
 protected:
  /// Listens on a free port and on a socket, and lets `count` connections in at a time, of which
  /// one address may have the share `client_share`.
  void Open(size_t count, double client_share = 1) {
    gate_.emplace(count, client_share, &log_, AddressWithoutPort);
    auto keeper = std::make_unique<Keeper>(taken_);
    keeper_ = keeper.get();
    address_ = *ParseListenAddress("127.0.0.1:0");
    ASSERT_TRUE(gate_->Listen(address_, std::move(keeper)).ok());
    ASSERT_NE(address_.port, 0);
    ASSERT_TRUE(ListenOnSocket(*gate_).ok());
    gate_->Open([] {});
  }

  absl::Status ListenOnSocket(ConnectionGate& gate) {
    return gate.Listen(socket_, std::make_unique<Keeper>(taken_));
  }

  int ConnectUnix() const {
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    socket_.socket_path.copy(name.sun_path, sizeof(name.sun_path) - 1);
    const int made = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(connect(made, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    return made;
  }

  /// Connects from an address of this machine, which is 127.0.0.`host`.
  int Connect(uint32_t host = 1) const {
    const int made = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in from{};
    from.sin_family = AF_INET;
    from.sin_addr.s_addr = htonl(INADDR_LOOPBACK - 1 + host);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<uint16_t>(address_.port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(made, reinterpret_cast<const sockaddr*>(&from), sizeof from), 0);
    EXPECT_EQ(connect(made, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    return made;
  }

  /// The same, and waits until the connection has its place.
  int ConnectTaken(uint32_t host = 1) {
    const int made = Connect(host);
    taken_.acquire();
    return made;
  }

  /// The name that the daemon has for a connection.
  static std::string NameOf(int connection) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    EXPECT_EQ(getsockname(connection, reinterpret_cast<sockaddr*>(&from), &size), 0);
    return absl::StrCat("ipv4:127.0.0.1:", ntohs(from.sin_port));
  }

  /// Ends the newest connection as gRPC does, and waits until the gate knows.
  void EndNewest() const {
    const size_t count = gate_->open_count();
    shutdown(keeper_->newest, SHUT_RDWR);
    close(keeper_->newest);
    while (gate_->open_count() == count) std::this_thread::yield();
  }

  /// The connection has no place, so that the taker is only to tell its client.
  void ExpectRefusal(int connection) const {
    keeper_->CloseRefused();
    EXPECT_TRUE(IsClosed(connection));
  }

  /// The daemon's end was closed.
  static bool IsClosed(int connection) {
    char byte = 0;
    return recv(connection, &byte, 1, 0) <= 0;
  }

  SystemClock clock_;
  std::vector<std::string> lines_;
  LimitedLog log_{clock_, "clients", [this](const std::string& line) { lines_.push_back(line); }};
  std::counting_semaphore<> taken_{0};
  Keeper* keeper_ = nullptr;
  const TemporaryFolder folder_;
  ListenAddress socket_{.socket_path = folder_ / "socket", .host = ""};
  ListenAddress address_;
  std::optional<ConnectionGate> gate_;
};

TEST_F(ConnectionGateTest, ForgetsAConnectionWhoseClientHasGone) {
  Open(8);
  const int made = ConnectUnix();
  taken_.acquire();
  EXPECT_EQ(gate_->open_count(), 1U);
  close(made);
  while (gate_->open_count() != 0) std::this_thread::yield();
}

TEST_F(ConnectionGateTest, EndsAConnectionWhoseDescriptorHasGoneToAnotherFile) {
  Open(4);
  const int made = ConnectTaken();
  std::array<int, 2> other{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, other.data()), 0);
  // As when gRPC closes its descriptor, and somebody opens another file, while the gate looks.
  ASSERT_EQ(dup2(other[0], keeper_->newest), keeper_->newest);
  EXPECT_TRUE(gate_->End(NameOf(made)));
  EXPECT_TRUE(IsClosed(made));
  char byte = 'x';
  ASSERT_EQ(send(other[1], &byte, 1, 0), 1);
  EXPECT_EQ(recv(keeper_->newest, &byte, 1, 0), 1);
}

TEST_F(ConnectionGateTest, ConnectionsThatHaveEndedTakeNoMemory) {
  Open(100000);
  const auto allocated_after = [this](int count) {
    for (int i = 0; i < count; ++i) {
      const int client = ConnectTaken();
      EndNewest();
      close(client);
    }
    return mallinfo2().uordblks;
  };
  const size_t before = allocated_after(500);
  // Without an end of that memory, each connection takes 150 bytes.
  EXPECT_LT(allocated_after(2000), before + 100000);
}

TEST_F(ConnectionGateTest, AnAddressGetsNoMoreThanItsShareAndTheLogNamesItOnce) {
  Open(8, 0.25);
  for (int i = 0; i < 2; ++i) ConnectTaken();
  for (int i = 0; i < 3; ++i) ExpectRefusal(Connect());
  ConnectTaken(11);  // whose name begins with that of 127.0.0.1
  for (int i = 0; i < 2; ++i) ConnectTaken(2);
  gate_.reset();
  EXPECT_THAT(lines_, testing::ElementsAre(testing::StartsWith(
                          "refused a new connection from ipv4:127.0.0.1: it has 2 already, its "
                          "share (--client-share) of 8; ")));
}

TEST_F(ConnectionGateTest, EndsAConnectionAndRefusesOthersFromTheSameAddress) {
  Open(4);
  const int first = ConnectTaken();
  const int second = ConnectTaken();
  EXPECT_FALSE(gate_->End("ipv4:127.0.0.1:0"));
  EXPECT_TRUE(gate_->End(NameOf(second)));
  EXPECT_FALSE(gate_->End(NameOf(second)));  // it ends already
  EXPECT_TRUE(gate_->Refuse("ipv4:127.0.0.1"));
  EXPECT_FALSE(gate_->Refuse("ipv4:127.0.0.1"));
  EXPECT_TRUE(IsClosed(second));
  EXPECT_TRUE(IsClosed(Connect()));
  EXPECT_TRUE(gate_->IsOpen(NameOf(first)));
}

TEST(SourceOfPeer, IsOneForAllConnectionsOfAProcessOrAddress) {
  EXPECT_EQ(SourceOfPeer("unix:pid-7/1"), SourceOfPeer("unix:pid-7/2"));
  EXPECT_NE(SourceOfPeer("unix:pid-7/1"), SourceOfPeer("unix:pid-71/1"));
  EXPECT_EQ(SourceOfPeer("ipv4:127.0.0.1:1"), SourceOfPeer("ipv4:127.0.0.2:2"));
  EXPECT_NE(SourceOfPeer("ipv4:192.0.2.1:1"), SourceOfPeer("ipv4:192.0.2.2:1"));
}

TEST_F(ConnectionGateTest, AUnixSocketIsItsOwnersUnlessOnlyAGroupMayEnterItsFolder) {
  for (const auto& [folder_mode, socket_mode] :
       {std::pair{0700U, 0600U}, {0755U, 0600U}, {0750U, 0660U}}) {
    ASSERT_EQ(chmod(folder_.path().c_str(), folder_mode), 0);
    ConnectionGate gate(1);
    ASSERT_TRUE(ListenOnSocket(gate).ok());
    struct stat status {};
    ASSERT_EQ(stat(socket_.socket_path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, socket_mode);
  }
}

TEST_F(ConnectionGateTest, RemovesItsSocketAndNoOtherThatTookItsPlace) {
  ConnectionGate second(1);
  {
    ConnectionGate first(1);
    ASSERT_TRUE(ListenOnSocket(first).ok());
    ASSERT_EQ(unlink(socket_.socket_path.c_str()), 0);
    ASSERT_TRUE(ListenOnSocket(second).ok());
  }
  EXPECT_THAT(PrepareSocket(socket_.socket_path).status().ToString(),
              testing::HasSubstr("LISTEN_FAILED: "));  // a daemon serves it
  EXPECT_TRUE(std::filesystem::exists(socket_.socket_path));
  second.Close();
  EXPECT_FALSE(std::filesystem::exists(socket_.socket_path));
}

TEST_F(ConnectionGateTest, RefusesAFolderInWhichOthersCouldReplaceTheSocket) {
  ASSERT_EQ(chmod(folder_.path().c_str(), 0777), 0);
  ConnectionGate gate(1);
  EXPECT_THAT(ListenOnSocket(gate).ToString(), testing::HasSubstr("LISTEN_FAILED: "));
  ASSERT_EQ(chmod(folder_.path().c_str(), 01777), 0);  // as /tmp has it
  EXPECT_TRUE(ListenOnSocket(gate).ok());
}

TEST(ListenAddress, KeepsWhatItWasGiven) {
  for (const char* text : {"unix:/run/carillon/socket", "127.0.0.1:50051", "localhost:0",
                           "[::1]:443", "example.org:65535"}) {
    const ListenAddress address = *ParseListenAddress(text);
    EXPECT_EQ(address.ToString(), text);
  }
}

TEST(ListenAddress, OnlyThisMachinesOwnAddressesAreLocal) {
  for (const char* text : {"unix:s", "127.0.0.1:1", "127.8.9.1:1", "localhost:1", "[::1]:1"}) {
    EXPECT_TRUE(ParseListenAddress(text)->is_local()) << text;
  }
  for (const char* text : {"0.0.0.0:1", "[::]:1", "10.0.0.1:1", "localhost.example.org:1"}) {
    EXPECT_FALSE(ParseListenAddress(text)->is_local()) << text;
  }
}

TEST(ListenAddress, RefusesWhatIsNoneAndAPathThatNoClientCouldReach) {
  for (const std::string& text :
       {std::string(), std::string("unix:"), std::string("localhost"), std::string(":80"),
        std::string("host:65536"), std::string("host:-1"), std::string("host:http"),
        std::string("::1:80"), std::string("[::1:80"), std::string("unix:/").append(107, 'x'),
        std::string("unix:/tmp/a,b"), std::string("unix:/tmp/a%20b"), std::string("unix:/tmp/a?b"),
        std::string("unix:/tmp/a#b")}) {
    const absl::Status status = ParseListenAddress(text).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(status.ToString(), testing::HasSubstr("INVALID_CONFIGURATION: "));
  }
  EXPECT_TRUE(ParseListenAddress("unix:/tmp/a b@c:d").ok());
}

TEST(ListenAddress, KeepsAFileThatIsNoSocket) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "thesis.txt";
  WriteBytes(file, "years of work");
  for (const std::filesystem::path& taken : {file, folder.path()}) {
    EXPECT_THAT(PrepareSocket(taken).status().ToString(),
                testing::HasSubstr("LISTEN_FAILED: \"" + taken.string()));
  }
  EXPECT_EQ(std::filesystem::file_size(file), 13U);
}

}  // namespace
}  // namespace carillon
