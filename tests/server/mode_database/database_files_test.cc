// SPDX-License-Identifier: Apache-2.0
//
// Somebody else changes the files of a database.

#include "server/mode_database/database_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "proto/cpp/status_macros.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/maintenance/database_keeper.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

class DatabaseFilesTest : public ::testing::Test {
 protected:
  DatabaseFilesTest() {
    WriteRecords(folder_ / "model", SampleRecords(SampleModel(20, 100)));
    Open();
    EXPECT_TRUE(Put("kept").ok());
  }

  void Open() {
    database_.reset();
    database_ = *ModeDatabase::Open(file_, clock_);
  }

  absl::Status Put(const std::string& name) {
    return database_->models().PutFile(Sha256Hex(name), name, folder_ / "model").status();
  }

  bool Has(const std::string& name) { return database_->models().Find(Sha256Hex(name)).ok(); }

  /// After `harm` nothing is acknowledged any more, and nothing new appears in the file's place.
  void ExpectLost(const std::function<void()>& harm) {
    harm();
    EXPECT_THAT(Put("new").ToString(), HasSubstr("DATABASE_LOST: "));
    EXPECT_THAT(database_->meshes().Put("solid").status().ToString(), HasSubstr("DATABASE_LOST: "));
    EXPECT_THAT(database_->models().Delete(Sha256Hex("kept")).ToString(),
                HasSubstr("DATABASE_LOST: "));
    EXPECT_FALSE(database_->database().CheckState().ok());
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "carillon.db";
  const std::filesystem::path log_ = folder_ / "carillon.db-wal";
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_;
};

TEST_F(DatabaseFilesTest, AfterTheFileWasReplacedNothingIsAcknowledged) {
  ExpectLost([&] {
    std::filesystem::copy_file(file_, folder_ / "copy");
    std::filesystem::rename(folder_ / "copy", file_);
  });
}

/// Stores enough in one change for a checkpoint.
absl::Status StoreMuch(Database& database) {
  constexpr size_t kBytes = size_t{8} << 20U;  // the log goes into the file beyond 4 MiB
  return database.Write([&](SqliteConnection& connection) {
    RETURN_IF_ERROR(connection.Run("CREATE TABLE IF NOT EXISTS much (bytes)"));
    return connection.Run("INSERT INTO much VALUES (?)", {SqlBlob{std::string(kBytes, 'x')}});
  });
}

TEST_F(DatabaseFilesTest,
       AfterTheFileWasTruncatedNothingIsAcknowledgedAlthoughChangesMakeItLonger) {
  for (const double share : {0.0, 0.5, 0.99}) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder / "carillon.db";
    const auto database = *Database::Open(file);
    ASSERT_TRUE(StoreMuch(*database).ok());
    const auto size = static_cast<double>(std::filesystem::file_size(file));
    std::filesystem::resize_file(file, static_cast<uintmax_t>(share * size));
    for (int i = 0; i < 2; ++i) {
      EXPECT_THAT(StoreMuch(*database).ToString(), HasSubstr("DATABASE_LOST: ")) << share;
    }
  }
}

TEST_F(DatabaseFilesTest, AFileThatWasReplacedAmidAChangeIsLost) {
  const absl::Status status = database_->database().Write([&](SqliteConnection& connection) {
    std::filesystem::copy_file(file_, folder_ / "copy");
    std::filesystem::rename(folder_ / "copy", file_);
    return connection.Run("UPDATE models SET label = 'changed'");
  });
  EXPECT_THAT(status.ToString(), HasSubstr("DATABASE_LOST: "));
}

TEST_F(DatabaseFilesTest, ACollectionDeletesMoreThanOneTransactionDoes) {
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(Put(std::to_string(i)).ok());
    ASSERT_TRUE(database_->meshes().Put("solid " + std::to_string(i)).ok());
  }
  std::set<std::string> told;
  const auto note = [&](const std::string& digest, uint64_t) { told.insert(digest); };
  EXPECT_EQ(database_->models().Collect(0, {.dry_run = true, .on_deleted = note})->model_count,
            41U);
  EXPECT_EQ(told.size(), 0U);
  EXPECT_EQ(database_->models().Collect(0, {.on_deleted = note})->model_count, 41U);
  EXPECT_EQ(told.size(), 41U);
  EXPECT_EQ(database_->models().Collect(0)->model_count, 0U);
  constexpr std::chrono::milliseconds kAnyAge(-1000);
  EXPECT_EQ(database_->meshes().Collect(kAnyAge, true)->mesh_count, 40U);
  EXPECT_EQ(database_->meshes().Collect(kAnyAge)->mesh_count, 40U);
  EXPECT_EQ(database_->meshes().Collect(kAnyAge)->mesh_count, 0U);
}

TEST_F(DatabaseFilesTest, ABackupIsMadeWhileOthersWrite) {
  Database& database = database_->database();
  ASSERT_TRUE(StoreMuch(database).ok());
  const auto pages = std::filesystem::file_size(file_) >> 20U;
  uintmax_t count = 0;
  const auto write = [&] {
    EXPECT_TRUE(Put(std::to_string(++count)).ok());
    return count < 2 * pages;
  };
  EXPECT_TRUE(BackUp(database, folder_ / "copy.db", write).ok());
  EXPECT_GT(count, pages / 2);
  // The copy is of the moment when it began.
  const auto copy = *ModeDatabase::Open(folder_ / "copy.db", clock_);
  EXPECT_TRUE(copy->models().Find(Sha256Hex("kept")).ok());
  EXPECT_FALSE(copy->models().Find(Sha256Hex("2")).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "copy.db-journal"));
}

TEST_F(DatabaseFilesTest, TheLogThatGrewBesideALongReadIsSmallAfterIt) {
  Database& database = database_->database();
  const absl::Status read = database.Read([&](SqliteConnection& connection) {
    RETURN_IF_ERROR(connection.Query("SELECT count(*) FROM models", {},
                                     [](const SqlRow&) { return absl::OkStatus(); }));
    for (int i = 0; i < 4; ++i) RETURN_IF_ERROR(StoreMuch(database));
    return absl::OkStatus();
  });
  ASSERT_TRUE(read.ok());
  EXPECT_GT(std::filesystem::file_size(log_), 20U << 20U);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(Put(std::to_string(i)).ok());
  EXPECT_LE(std::filesystem::file_size(log_), 16U << 20U);
}

TEST_F(DatabaseFilesTest, TheLogStaysSmallHoweverMuchIsWritten) {
  for (int i = 0; i < 60; ++i) ASSERT_TRUE(Put(std::to_string(i)).ok());
  EXPECT_GT(std::filesystem::file_size(file_), 1U << 20U);
  EXPECT_LT(std::filesystem::file_size(log_), 5U << 20U);
}

TEST_F(DatabaseFilesTest, TheFileShrinksAfterDeletions) {
  WriteRecords(folder_ / "model", SampleRecords(SampleModel(200, 5000)));
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(Put(std::to_string(i)).ok());
  Open();
  const uintmax_t before = std::filesystem::file_size(file_);
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(database_->models().Delete(Sha256Hex(std::to_string(i))).ok());
  }
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(database_->database().Tidy().ok());
  EXPECT_LT(std::filesystem::file_size(file_), before / 2);
  EXPECT_TRUE(Has("kept"));
  EXPECT_TRUE(Put("new").ok());
  Open();
  EXPECT_TRUE(Has("new"));
}

TEST_F(DatabaseFilesTest, AReaderConnectsWhileAChangeIsBeingMade) {
  Database& database = database_->database();
  const auto nothing = [](SqliteConnection&) { return absl::OkStatus(); };
  const absl::Status written = database.Write([&](SqliteConnection& writer) {
    const absl::Status changed = writer.Run("UPDATE models SET label = 'changed'");
    // Each of the readers is a new connection.
    return changed.ok() ? database.Read([&](SqliteConnection&) { return database.Read(nothing); })
                        : changed;
  });
  EXPECT_TRUE(written.ok()) << written;
}

TEST_F(DatabaseFilesTest, UnfinishedCopiesAreRemovedAtTheStartAndNothingElse) {
  const std::vector<std::filesystem::path> unfinished = {
      NewBackupFile(file_), UnfinishedCopy(file_, "restore"), UnfinishedCopy(file_, "restore-wal")};
  // Names that an operator may give.
  const std::vector<std::filesystem::path> others = {
      folder_ / "backup-2026",
      folder_ / "carillon.db-backup-2026",
      folder_ / "carillon.db.incoming",
      folder_ / "carillon.db.repaired",
      folder_ / "carillon.db-unfinished-backup-notes",
      folder_ / "carillon.db-unfinished-work"};
  for (const auto& path : unfinished) std::ofstream(path) << "x";
  for (const auto& path : others) std::ofstream(path) << "x";
  Open();
  for (const auto& path : unfinished) EXPECT_FALSE(std::filesystem::exists(path)) << path;
  for (const auto& path : others) EXPECT_TRUE(std::filesystem::exists(path)) << path;
}

TEST_F(DatabaseFilesTest, ADatabaseMayLieWhereALinkLeads) {
  const TemporaryFolder disk;
  std::filesystem::create_symlink(disk / "real.db", folder_ / "link.db");
  EXPECT_THAT(ModeDatabase::Open(folder_ / "link.db", clock_).status().ToString(),
              HasSubstr("link.db cannot be opened: it is a symbolic link that leads to no file"));
  EXPECT_FALSE(std::filesystem::exists(disk / "real.db"));
  database_.reset();
  std::filesystem::copy_file(file_, disk / "real.db");
  database_ = *ModeDatabase::Open(folder_ / "link.db", clock_);
  EXPECT_TRUE(Has("kept"));
  EXPECT_TRUE(std::filesystem::exists(disk / "real.db-wal"));
  ExpectLost([&] { std::filesystem::remove(disk / "real.db"); });
}

TEST_F(DatabaseFilesTest, TheKeeperTellsWhenTheFilesAreLost) {
  std::vector<bool> good;
  DatabaseKeeper keeper(database_->database(),
                        [&good](const absl::Status& files) { good.push_back(files.ok()); });
  for (int i = 0; i < 3; ++i) keeper.Look();
  EXPECT_THAT(good, testing::ElementsAre(true));
  std::filesystem::remove(file_);
  for (int i = 0; i < 3; ++i) keeper.Look();
  EXPECT_THAT(good, testing::ElementsAre(true, false));
}

}  // namespace
}  // namespace carillon
