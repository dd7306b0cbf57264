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
#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
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
  /// Listens on a free port, and lets `count` connections in at a time, of which one address may
  /// have the share `client_share`.
  void Open(
      size_t count, double client_share = 1,
      const std::function<absl::Status(ConnectionGate&)>& listen = [](ConnectionGate&) {
        return absl::OkStatus();
      }) {
    gate_.emplace(count, client_share, &log_, AddressWithoutPort);
    auto keeper = std::make_unique<Keeper>(taken_);
    keeper_ = keeper.get();
    address_ = *ParseListenAddress("127.0.0.1:0");
    ASSERT_TRUE(gate_->Listen(address_, std::move(keeper)).ok());
    ASSERT_NE(address_.port, 0);
    ASSERT_TRUE(listen(*gate_).ok());
    gate_->Open([this] { ++first_count_; });
  }

  static int ConnectUnix(const std::string& path) {
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    path.copy(name.sun_path, sizeof(name.sun_path) - 1);
    const int made = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(connect(made, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    return made;
  }

  /// Connects from an address of this machine, which is 127.0.0.`host`.
  int Connect(uint32_t host = 1) const { return Connect(Socket(), host); }

  int Connect(int made, uint32_t host) const {
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

  static int Socket() { return socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0); }

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
  std::counting_semaphore<> logged_{0};
  std::vector<std::string> lines_;
  LimitedLog log_{clock_, "clients", [this](const std::string& line) {
                    lines_.push_back(line);
                    logged_.release();
                  }};
  std::counting_semaphore<> taken_{0};
  Keeper* keeper_ = nullptr;
  std::atomic<int> first_count_{0};
  ListenAddress address_;
  std::optional<ConnectionGate> gate_;
};

TEST_F(ConnectionGateTest, ClosesConnectionsBeyondItsLimitAndAcceptsAgainWhenOneHasEnded) {
  Open(2);
  for (int i = 0; i < 2; ++i) {
    Connect();
    taken_.acquire();
  }
  ExpectRefusal(Connect());
  EndNewest();
  Connect();
  taken_.acquire();
  ExpectRefusal(Connect());
}

TEST_F(ConnectionGateTest, ForgetsAConnectionWhoseClientHasGone) {
  const TemporaryFolder folder;
  const ListenAddress address{.socket_path = folder / "socket", .host = ""};
  Open(8, 1, [&](ConnectionGate& gate) {
    ListenAddress listened = address;
    return gate.Listen(listened, std::make_unique<Keeper>(taken_));
  });
  const int made = ConnectUnix(address.socket_path);
  taken_.acquire();
  EXPECT_EQ(gate_->open_count(), 1U);
  close(made);
  while (gate_->open_count() != 0) std::this_thread::yield();
}

TEST_F(ConnectionGateTest, EndsAConnectionWhoseDescriptorHasGoneToAnotherFile) {
  Open(4);
  const int made = Connect();
  taken_.acquire();
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
      const int client = Connect();
      taken_.acquire();
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
  for (int i = 0; i < 2; ++i) {
    Connect();
    taken_.acquire();
  }
  for (int i = 0; i < 3; ++i) ExpectRefusal(Connect());
  Connect(11);  // whose name begins with that of 127.0.0.1
  taken_.acquire();
  for (int i = 0; i < 2; ++i) {
    Connect(2);
    taken_.acquire();
  }
  gate_.reset();
  EXPECT_THAT(lines_, testing::ElementsAre(testing::StartsWith(
                          "refused a new connection from ipv4:127.0.0.1: it has 2 already, its "
                          "share (--client-share) of 8; ")));
}

TEST_F(ConnectionGateTest, EndsAConnectionAndRefusesOthersFromTheSameAddress) {
  Open(4);
  const int first = Connect();
  taken_.acquire();
  const int second = Connect();
  taken_.acquire();
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
    const TemporaryFolder folder;
    ASSERT_EQ(chmod(folder.path().c_str(), folder_mode), 0);
    ConnectionGate gate(1);
    ListenAddress address{.socket_path = folder / "socket", .host = ""};
    ASSERT_TRUE(gate.Listen(address, std::make_unique<Keeper>(taken_)).ok());
    struct stat status {};
    ASSERT_EQ(stat((folder / "socket").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, socket_mode);
  }
}

TEST_F(ConnectionGateTest, RemovesItsSocketAndNoOtherThatTookItsPlace) {
  const TemporaryFolder folder;
  ListenAddress address{.socket_path = folder / "socket", .host = ""};
  ConnectionGate second(1);
  {
    ConnectionGate first(1);
    ASSERT_TRUE(first.Listen(address, std::make_unique<Keeper>(taken_)).ok());
    ASSERT_EQ(unlink(address.socket_path.c_str()), 0);
    ASSERT_TRUE(second.Listen(address, std::make_unique<Keeper>(taken_)).ok());
  }
  EXPECT_TRUE(std::filesystem::exists(address.socket_path));
  second.Close();
  EXPECT_FALSE(std::filesystem::exists(address.socket_path));
}

TEST_F(ConnectionGateTest, RefusesAFolderInWhichOthersCouldReplaceTheSocket) {
  const TemporaryFolder folder;
  ASSERT_EQ(chmod(folder.path().c_str(), 0777), 0);
  ConnectionGate gate(1);
  ListenAddress address{.socket_path = folder / "socket", .host = ""};
  const absl::Status status = gate.Listen(address, std::make_unique<Keeper>(taken_));
  EXPECT_THAT(status.ToString(), testing::HasSubstr("LISTEN_FAILED: "));
  ASSERT_EQ(chmod(folder.path().c_str(), 01777), 0);  // as /tmp has it
  EXPECT_TRUE(gate.Listen(address, std::make_unique<Keeper>(taken_)).ok());
}

}  // namespace
}  // namespace carillon
