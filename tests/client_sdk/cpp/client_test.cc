// SPDX-License-Identifier: Apache-2.0
//
// What a client does without a daemon; tests/integration has the rest, with one.
#include "carillon/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "absl/strings/str_cat.h"

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
  EXPECT_THAT(client_->IsServing("").status().ToString(), unavailable);
  EXPECT_THAT(client_->GetMixer().status().ToString(), unavailable);
  EXPECT_THAT(client_->UploadMesh("v 0 0 0").status().ToString(), unavailable);
  EXPECT_THAT(client_->WatchJob("jobs/a", nullptr).status().ToString(), unavailable);
  EXPECT_THAT(client_->Listen([](const AudioBlock&) { return true; }).ToString(), unavailable);
  EXPECT_THAT(client_->StreamContacts({}).status().ToString(), unavailable);
}

TEST_F(ClientWithoutDaemon, RefusesAnEmptyCallbackInsteadOfCallingIt) {
  const std::string path = testing::TempDir() + "empty_callback.contacts";
  auto writer = ContactTraceWriter::Create(path, {});
  ASSERT_TRUE(writer.ok() && writer->Close().ok());
  auto trace = ContactTraceReader::Open(path);
  ASSERT_TRUE(trace.ok()) << trace.status();
  const auto refused = [](const char* name) {
    return HasSubstr(absl::StrCat("INVALID_SETTINGS: ", name, " is empty; "));
  };
  EXPECT_THAT(client_->Render({}, *trace, AudioCallback()).status().ToString(),
              refused("on_block"));
  EXPECT_THAT(client_->Listen(nullptr).ToString(), refused("on_block"));
  EXPECT_THAT(client_->RecordContacts("scenes/1", nullptr, nullptr).ToString(),
              refused("on_record"));
  EXPECT_THAT(client_->WatchJobs({}, nullptr).ToString(), refused("on_answer"));
}

}  // namespace
}  // namespace carillon::client
