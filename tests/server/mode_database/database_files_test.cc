// SPDX-License-Identifier: Apache-2.0
//
// Somebody else changes the files of a database.
#include "server/mode_database/database_files.h"

#include <algorithm>
#include <functional>
#include <future>
#include <set>
#include <thread>

#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/mode_database/database.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/maintenance/database_keeper.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/database_fixture.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DatabaseFilesTest : public DatabaseTest {
 protected:
  DatabaseFilesTest() { EXPECT_TRUE(Put("kept").ok()); }

  /// After `harm` nothing is acknowledged any more, and nothing new appears in the file's place.
  void ExpectLost(const std::function<void()>& harm) {
    harm();
    EXPECT_THAT(Put("new").ToString(), HasSubstr("DATABASE_LOST: "));
    EXPECT_THAT(database_->meshes().Put("solid").status().ToString(), HasSubstr("DATABASE_LOST: "));
    EXPECT_THAT(database_->models().Delete(Sha256Hex("kept")).ToString(),
                HasSubstr("DATABASE_LOST: "));
    EXPECT_FALSE(database_->database().CheckState().ok());
  }

  const std::filesystem::path log_ = folder_ / "carillon.db-wal";
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
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(Put(std::to_string(i), SampleModel(200, 5000)).ok());
  }
  Reopen();
  const uintmax_t before = std::filesystem::file_size(file_);
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(database_->models().Delete(Sha256Hex(std::to_string(i))).ok());
  }
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(database_->database().Tidy().ok());
  EXPECT_LT(std::filesystem::file_size(file_), before / 2);
  EXPECT_TRUE(Has("kept"));
  EXPECT_TRUE(Put("new").ok());
  Reopen();
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
  Reopen();
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

/// Another process holds the database for writing.
class HeldDatabaseTest : public DatabaseFilesTest {
 protected:
  HeldDatabaseTest() { EXPECT_TRUE(other_->Run("BEGIN IMMEDIATE").ok()); }

  const std::unique_ptr<SqliteConnection> other_ = *SqliteConnection::Open(file_);
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

// A copy takes the place of a database.

using std::filesystem::path;
using ::testing::Contains;
using ::testing::Not;

class DatabaseRestoreTest : public ::testing::Test {
 protected:
  DatabaseRestoreTest() { WriteRecords(folder_ / "model", SampleRecords(SampleModel(20, 100))); }

  /// Stores a model of this name in a database.
  void Put(const path& file, const std::string& name) {
    const auto database = *ModeDatabase::Open(file, clock_);
    EXPECT_TRUE(database->models().PutFile(Sha256Hex(name), name, folder_ / "model").status().ok());
  }

  std::vector<std::string> Labels(const path& file) {
    const auto database = *ModeDatabase::Open(file, clock_);
    std::vector<std::string> labels;
    const ModelPage page = *database->models().List({}, 0, "");
    for (const ModelSummary& model : page.models) labels.push_back(model.label);
    return labels;
  }

  /// Makes the files that a daemon leaves if it is killed while its only model is in the log.
  void CopyWithLog(const std::string& name) {
    const path live = folder_ / "live";
    std::filesystem::remove_all(live);
    const auto database = *ModeDatabase::Open(live / "db", clock_);
    EXPECT_TRUE(database->models()
                    .PutFile(Sha256Hex("in the log"), "in the log", folder_ / "model")
                    .status()
                    .ok());
    for (const char* suffix : {"", "-wal"}) {
      std::filesystem::copy_file(live / (std::string("db") + suffix), folder_ / (name + suffix),
                                 std::filesystem::copy_options::overwrite_existing);
    }
  }

  /// The names of all files in the folder.
  std::vector<std::string> Names() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  TemporaryFolder folder_;
  const path file_ = folder_ / "carillon.db";
  SystemClock clock_;
};

TEST_F(DatabaseRestoreTest, ADatabaseIsRestoredWithItsLog) {
  Put(file_, "old");
  CopyWithLog("copy");
  ASSERT_TRUE(RestoreDatabase(file_, folder_ / "copy").ok());
  EXPECT_THAT(Labels(file_), ElementsAre("in the log"));
}

TEST_F(DatabaseRestoreTest, TheNewDatabaseDoesNotGetTheLogOfTheOld) {
  CopyWithLog("carillon.db");
  std::ofstream(folder_ / "carillon.db-shm") << "an index";
  Put(folder_ / "copy", "new");
  const auto kept = *RestoreDatabase(file_, folder_ / "copy");
  EXPECT_THAT(Names(), Not(Contains(testing::AnyOf("carillon.db-wal", "carillon.db-shm"))));
  EXPECT_THAT(Labels(file_), ElementsAre("new"));
  EXPECT_THAT(Labels(kept), ElementsAre("in the log"));
}

TEST_F(DatabaseRestoreTest, AFileThatIsNoDatabaseOfCarillonReplacesNothing) {
  Put(file_, "old");
  const std::vector<std::string> before = Names();
  const path foreign = folder_ / "foreign";
  ASSERT_TRUE((*SqliteConnection::Open(foreign))->RunScript("CREATE TABLE models (digest)").ok());
  { const std::ofstream empty(folder_ / "empty"); }
  std::ofstream(folder_ / "text") << std::string(5000, 'x');
  for (const char* name : {"foreign", "empty", "text"}) {
    EXPECT_THAT(RestoreDatabase(file_, folder_ / name).status().ToString(),
                HasSubstr(std::string(name) + " is not a database of Carillon: name a file"));
    std::filesystem::remove(folder_ / name);
  }
  std::filesystem::create_directory(folder_ / "folder");
  EXPECT_THAT(RestoreDatabase(file_, folder_ / "folder").status().ToString(),
              HasSubstr("DATABASE_UNUSABLE: "));
  std::filesystem::remove(folder_ / "folder");
  EXPECT_THAT(Labels(file_), ElementsAre("old"));
  EXPECT_EQ(Names(), before);
}

TEST_F(DatabaseRestoreTest, ADatabaseIsNotRestoredFromItself) {
  Put(file_, "old");
  std::filesystem::create_symlink(file_, folder_ / "link");
  const path unfinished = UnfinishedCopy(file_, "restore");
  Put(unfinished, "new");
  for (const path& name : {path("carillon.db"), path("link"), unfinished.filename()}) {
    EXPECT_THAT(RestoreDatabase(file_, folder_ / name).status().ToString(),
                HasSubstr("which the restore would replace: name a backup"));
  }
  EXPECT_THAT(Labels(unfinished), ElementsAre("new"));
  EXPECT_THAT(Labels(file_), ElementsAre("old"));
}

TEST_F(DatabaseRestoreTest, ARestoreFollowsLinksToItsFiles) {
  const path disk = folder_ / "disk";
  std::filesystem::create_directory(disk);
  Put(disk / "real.db", "old");
  std::filesystem::create_symlink(disk / "real.db", file_);
  CopyWithLog("copy");
  std::filesystem::create_symlink("copy", folder_ / "newest");
  const auto kept = *RestoreDatabase(file_, folder_ / "newest");
  EXPECT_TRUE(std::filesystem::is_symlink(file_));
  EXPECT_THAT(Labels(disk / "real.db"), ElementsAre("in the log"));
  EXPECT_THAT(Labels(kept), ElementsAre("old"));
  std::filesystem::remove(disk / "real.db");
  EXPECT_THAT(RestoreDatabase(file_, folder_ / "copy").status().ToString(),
              HasSubstr("it is a symbolic link that leads to no file"));
  EXPECT_TRUE(std::filesystem::is_symlink(file_));
}

}  // namespace
}  // namespace carillon
