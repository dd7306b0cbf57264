// SPDX-License-Identifier: Apache-2.0
//
// What a client does without a daemon; tests/integration has the rest, with one.
#include "carillon/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carillon::client {
namespace {

using testing::HasSubstr;

class ClientWithoutDaemon : public testing::Test {
 protected:
  const std::unique_ptr<Client> client_ = Connect("unix:/proc/no/such/socket");
};

TEST_F(ClientWithoutDaemon, IsToldSoByEveryKindOfCall) {
  const auto unavailable = HasSubstr("SERVER_UNAVAILABLE: ");
  EXPECT_THAT(client_->GetServerInfo().status().ToString(), unavailable);
  EXPECT_THAT(client_->GetMixer().status().ToString(), unavailable);
  EXPECT_THAT(client_->UploadMesh("v 0 0 0").status().ToString(), unavailable);
  EXPECT_THAT(client_->WatchJob("jobs/a", nullptr).status().ToString(), unavailable);
  EXPECT_THAT(client_->Listen([](const AudioBlock&) { return true; }).ToString(), unavailable);
  EXPECT_THAT(client_->StreamContacts({}).status().ToString(), unavailable);
}

}  // namespace
}  // namespace carillon::client
