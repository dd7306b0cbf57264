// SPDX-License-Identifier: Apache-2.0
//
// Another process holds the database for writing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "proto/cpp/error_reason.h"
#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/maintenance/database_keeper.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class HeldDatabaseTest : public ::testing::Test {
 protected:
  HeldDatabaseTest() {
    WriteRecords(folder_ / "model", SampleRecords(SampleModel(20, 100)));
    EXPECT_TRUE(Put("kept").ok());
    other_ = *SqliteConnection::Open(folder_ / "carillon.db");
    EXPECT_TRUE(other_->Run("BEGIN IMMEDIATE").ok());
  }

  absl::Status Put(const std::string& name) {
    return database_->models().PutFile(Sha256Hex(name), name, folder_ / "model").status();
  }

  TemporaryFolder folder_;
  SystemClock clock_;
  const std::unique_ptr<ModeDatabase> database_ =
      *ModeDatabase::Open(folder_ / "carillon.db", clock_);
  std::unique_ptr<SqliteConnection> other_;
};

TEST_F(HeldDatabaseTest, ChangesThatWaitTogetherGiveUpTogether) {
  std::vector<std::future<absl::Status>> changes;
  for (const char* name : {"a", "b", "c"}) {
    changes.push_back(std::async(std::launch::async, [this, name] { return Put(name); }));
  }
  // A change that waited for the one before and then 10 s more would find the database free.
  std::this_thread::sleep_for(std::chrono::seconds(15));
  ASSERT_TRUE(other_->Run("ROLLBACK").ok());
  for (auto& change : changes) {
    EXPECT_THAT(change.get().ToString(), HasSubstr("DATABASE_BUSY: "));
  }
  EXPECT_TRUE(Put("a").ok());
}

TEST_F(HeldDatabaseTest, TheKeeperTellsUntilTheDatabaseCanBeChangedAgain) {
  std::vector<std::string> told;
  DatabaseKeeper keeper(database_->database(), [&told](const absl::Status& state) {
    told.push_back(state.ok() ? "OK" : ToErrorInfo(state).reason());
  });
  keeper.Look();
  EXPECT_FALSE(Put("a").ok());
  for (int i = 0; i < 3; ++i) keeper.Look();
  EXPECT_THAT(told, ElementsAre("OK", "DATABASE_BUSY"));
  EXPECT_FALSE(database_->database().CheckState().ok());
  ASSERT_TRUE(other_->Run("ROLLBACK").ok());
  for (int i = 0; i < 3; ++i) keeper.Look();
  EXPECT_THAT(told, ElementsAre("OK", "DATABASE_BUSY", "OK"));
  EXPECT_TRUE(database_->database().CheckState().ok());
}

TEST_F(HeldDatabaseTest, ModelsAreFoundWhileACollectionWaits) {
  auto collected =
      std::async(std::launch::async, [this] { return database_->models().Collect(0); });
  // The collection has begun to wait, which it does for 10 s.
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_TRUE(database_->models().FindToSound(Sha256Hex("kept")).ok());
  EXPECT_EQ(collected.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  ASSERT_TRUE(other_->Run("ROLLBACK").ok());
  EXPECT_EQ(collected.get()->model_count, 1U);
}

}  // namespace
}  // namespace carillon
