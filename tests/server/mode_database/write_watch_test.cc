// SPDX-License-Identifier: Apache-2.0
//
// Somebody overwrites the files of a database in place, or changes them by SQLite.

#include "server/mode_database/write_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "proto/cpp/status_macros.h"
#include "server/base/clock.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

/// Stores a row in a table of its own, by one change.
absl::Status Store(Database& database, size_t byte_count) {
  return database.Write([&](SqliteConnection& connection) {
    RETURN_IF_ERROR(connection.Run("CREATE TABLE IF NOT EXISTS rows (bytes)"));
    return connection.Run("INSERT INTO rows VALUES (?)", {SqlBlob{std::string(byte_count, 'x')}});
  });
}

absl::Status StoreLittle(Database& database) { return Store(database, 1); }

/// Stores enough for a copy of the log into the file, which follows 4 MiB.
absl::Status StoreMuch(Database& database) { return Store(database, size_t{8} << 20U); }

/// Writes bytes over the beginning of a file that stays the same file, as `cp` does.
void Overwrite(const std::filesystem::path& file, const std::string& bytes) {
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

class WriteWatchTest : public ::testing::Test {
 protected:
  WriteWatchTest() {
    Open();
    EXPECT_EQ(StoreLittle(*database_), absl::OkStatus());
    Open();  // the log has gone into the file
  }

  void Open() {
    database_.reset();
    database_ = *Database::Open(file_);
    database_->CopyLog();
  }

  /// Another database, larger than this one.
  std::string LargerDatabase() {
    const TemporaryFolder folder;
    EXPECT_TRUE(StoreMuch(*(*Database::Open(folder / "carillon.db"))).ok());
    return ReadBytes(folder / "carillon.db");
  }

  void ExpectLost(const std::string& what) {
    for (int i = 0; i < 2; ++i) {
      EXPECT_THAT(StoreLittle(*database_).ToString(), HasSubstr("DATABASE_LOST: ")) << what;
    }
    EXPECT_TRUE(LossMark(file_).IsSet()) << what;
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "carillon.db";
  const std::filesystem::path log_ = folder_ / "carillon.db-wal";
  std::unique_ptr<Database> database_;
};

TEST_F(WriteWatchTest, NoChangeIsAcknowledgedAfterALargerDatabaseWasCopiedOverTheFile) {
  const std::string larger = LargerDatabase();
  ASSERT_GT(larger.size(), std::filesystem::file_size(file_));
  for (const bool has_log : {false, true}) {
    Open();
    if (has_log) {
      ASSERT_TRUE(StoreLittle(*database_).ok());
    }
    const std::string before = ReadBytes(file_);
    Overwrite(file_, larger);
    ExpectLost(has_log ? "with a log" : "without a log");
    database_.reset();
    EXPECT_TRUE(ReadBytes(file_) == larger);
    std::ofstream(file_, std::ios::binary) << before;
  }
}

TEST_F(WriteWatchTest, NoChangeIsAcknowledgedAfterTheBeginningOfTheFileWasOverwritten) {
  const std::string whole = ReadBytes(file_);
  for (const size_t byte_count : {1, 100, 1024, 65536}) {
    Open();
    ASSERT_TRUE(StoreLittle(*database_).ok());
    Overwrite(file_, std::string(byte_count, '\0'));
    ExpectLost(std::to_string(byte_count));
    database_.reset();
    std::filesystem::remove(log_);
    std::ofstream(file_, std::ios::binary) << whole;
    LossMark(file_).Remove();
  }
}

TEST_F(WriteWatchTest, AChangeDuringWhichTheFileWasOverwrittenIsNotAcknowledged) {
  const std::string before = ReadBytes(file_);
  for (const bool begins_the_log_anew : {true, false}) {
    Open();
    if (!begins_the_log_anew) {
      ASSERT_TRUE(StoreLittle(*database_).ok());
    }
    const absl::Status status = database_->Write([&](SqliteConnection& connection) {
      Overwrite(file_, std::string(100, '\0'));
      return connection.Run("INSERT INTO rows VALUES ('')");
    });
    EXPECT_THAT(status.ToString(), HasSubstr("DATABASE_LOST: ")) << begins_the_log_anew;
    database_.reset();
    std::filesystem::remove(log_);
    std::ofstream(file_, std::ios::binary) << before;
    LossMark(file_).Remove();
  }
}

TEST_F(WriteWatchTest, AFileThatIsOverwrittenAfterACrashIsLost) {
  ASSERT_TRUE(StoreLittle(*database_).ok());
  const TemporaryFolder crashed;
  for (const char* name : {"carillon.db", "carillon.db-wal"}) {
    std::filesystem::copy_file(folder_ / name, crashed / name);
  }
  const SystemClock clock;
  const auto database = *ModeDatabase::Open(crashed / "carillon.db", clock);
  Overwrite(crashed / "carillon.db", LargerDatabase());
  EXPECT_THAT(StoreLittle(database->database()).ToString(), HasSubstr("DATABASE_LOST: "));
}

TEST_F(WriteWatchTest, ALogThatWasOverwrittenIsLost) {
  ASSERT_TRUE(StoreLittle(*database_).ok());
  Overwrite(log_, std::string(std::filesystem::file_size(log_), '\0'));
  ExpectLost("log");
}

TEST_F(WriteWatchTest, AnOlderIndexOfTheLogIsNoticedBeforeItsFramesAreOverwritten) {
  const std::filesystem::path index = folder_ / "carillon.db-shm";
  ASSERT_TRUE(StoreLittle(*database_).ok());
  const std::string older = ReadBytes(index);
  ASSERT_TRUE(StoreLittle(*database_).ok());
  const auto count_rows = [&] {
    int64_t count = 0;
    EXPECT_TRUE(database_
                    ->Read([&](SqliteConnection& connection) {
                      return connection.Query("SELECT count(*) FROM rows", {},
                                              [&](const SqlRow& row) {
                                                count = row.Int(0);
                                                return absl::OkStatus();
                                              });
                    })
                    .ok());
    return count;
  };
  const int64_t acknowledged = count_rows();
  Overwrite(index, older);
  ExpectLost("index");
  Open();
  EXPECT_EQ(count_rows(), acknowledged);
}

TEST_F(WriteWatchTest, AChangeThatAnotherProgramMakesBySqliteIsNoDamage) {
  const std::string update = "UPDATE facts SET value = value;";
  const std::string copy = "PRAGMA wal_checkpoint(RESTART);";
  const std::string grow =
      "CREATE TABLE IF NOT EXISTS a (b); INSERT INTO a VALUES (zeroblob(9e6));";
  for (const std::string& change : {update, copy, copy + update, update + copy, grow, update}) {
    ASSERT_TRUE((*SqliteConnection::Open(file_))->RunScript(change.c_str()).ok()) << change;
    EXPECT_EQ(StoreLittle(*database_).ToString(), "OK") << change;
    EXPECT_EQ(StoreMuch(*database_).ToString(), "OK") << change;
  }
  Overwrite(log_, std::string(std::filesystem::file_size(log_), '\0'));
  ExpectLost("log");
}

TEST_F(WriteWatchTest, ChangesThatAnotherProgramMakesAtTheSameTimeAreNoDamage) {
  std::atomic<bool> stop = false;
  std::thread other([&] {
    const auto connection = *SqliteConnection::Open(file_);
    while (!stop) {
      // Each may have to wait for the other longer than it likes to.
      connection->RunScript("INSERT INTO rows VALUES (zeroblob(70000))").IgnoreError();
      connection->RunScript("PRAGMA wal_checkpoint(PASSIVE)").IgnoreError();
    }
  });
  absl::Status status;
  for (int i = 0; i < 300 && status.ok(); ++i) status = Store(*database_, i * 1000);
  stop = true;
  other.join();
  EXPECT_EQ(status, absl::OkStatus());
  EXPECT_EQ(StoreLittle(*database_), absl::OkStatus());
  Overwrite(file_, std::string(100, '\0'));
  ExpectLost("file");
}

}  // namespace
}  // namespace carillon
