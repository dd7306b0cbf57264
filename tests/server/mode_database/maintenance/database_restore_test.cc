// SPDX-License-Identifier: Apache-2.0
//
// A copy takes the place of a database.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_files.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using std::filesystem::path;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
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

TEST_F(DatabaseRestoreTest, EveryDatabaseThatWasReplacedIsKept) {
  Put(file_, "first");
  for (const char* name : {"second", "third"}) {
    const path copy = folder_ / name;
    Put(copy, name);
    const auto kept = RestoreDatabase(file_, copy);
    ASSERT_TRUE(kept.ok()) << kept.status();
  }
  EXPECT_THAT(Labels(file_), ElementsAre("third"));
  EXPECT_THAT(Labels(folder_ / "carillon.db.replaced"), ElementsAre("first"));
  EXPECT_THAT(Labels(folder_ / "carillon.db.replaced-2"), ElementsAre("second"));
}

TEST_F(DatabaseRestoreTest, ADatabaseIsRestoredWithItsLog) {
  Put(file_, "old");
  CopyWithLog("copy");
  const auto kept = RestoreDatabase(file_, folder_ / "copy");
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_THAT(Labels(file_), ElementsAre("in the log"));
}

TEST_F(DatabaseRestoreTest, TheNewDatabaseDoesNotGetTheLogOfTheOld) {
  CopyWithLog("carillon.db");
  std::ofstream(folder_ / "carillon.db-shm") << "an index";
  Put(folder_ / "copy", "new");
  const auto kept = RestoreDatabase(file_, folder_ / "copy");
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_THAT(Names(), Not(Contains(testing::AnyOf("carillon.db-wal", "carillon.db-shm"))));
  EXPECT_THAT(Labels(file_), ElementsAre("new"));
  EXPECT_THAT(Labels(*kept), ElementsAre("in the log"));
}

TEST_F(DatabaseRestoreTest, AKeptDatabaseNeverGetsTheLogOfAnother) {
  Put(file_, "old");
  Put(folder_ / "copy", "new");
  std::ofstream(folder_ / "carillon.db.replaced-wal") << "of another";
  const auto kept = RestoreDatabase(file_, folder_ / "copy");
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->filename(), "carillon.db.replaced-2");
  EXPECT_THAT(Labels(*kept), ElementsAre("old"));
}

TEST_F(DatabaseRestoreTest, ALogThatIsLeftAloneIsKeptUnderAPrintedName) {
  Put(folder_ / "copy", "new");
  std::ofstream(folder_ / "carillon.db-wal") << "a log";
  const auto kept = RestoreDatabase(file_, folder_ / "copy");
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_EQ(kept->filename(), "carillon.db.replaced");
  EXPECT_TRUE(std::filesystem::exists(kept->string() + "-wal"));
  EXPECT_THAT(Labels(file_), ElementsAre("new"));
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
  const auto kept = RestoreDatabase(file_, folder_ / "newest");
  ASSERT_TRUE(kept.ok()) << kept.status();
  EXPECT_TRUE(std::filesystem::is_symlink(file_));
  EXPECT_THAT(Labels(disk / "real.db"), ElementsAre("in the log"));
  EXPECT_THAT(Labels(*kept), ElementsAre("old"));
  std::filesystem::remove(disk / "real.db");
  EXPECT_THAT(RestoreDatabase(file_, folder_ / "copy").status().ToString(),
              HasSubstr("it is a symbolic link that leads to no file"));
  EXPECT_TRUE(std::filesystem::is_symlink(file_));
}

/// Makes a file immutable, or takes that back. Returns whether this user and the file system can.
bool SetImmutable(const path& file, bool immutable) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  int flags = 0;
  bool can = ioctl(descriptor, FS_IOC_GETFLAGS, &flags) == 0;
  flags = immutable ? flags | FS_IMMUTABLE_FL : flags & ~FS_IMMUTABLE_FL;
  can = can && ioctl(descriptor, FS_IOC_SETFLAGS, &flags) == 0;
  close(descriptor);
  return can;
}

TEST_F(DatabaseRestoreTest, AnImmutableFileOfTheOldDatabaseKeepsItInPlace) {
  Put(folder_ / "copy", "new");
  for (const char* name : {"carillon.db", "carillon.db-wal", "carillon.db-shm"}) {
    Put(file_, "old");
    { const std::ofstream empty(folder_ / name, std::ios::app); }
    if (!SetImmutable(folder_ / name, true)) GTEST_SKIP() << "no file can be made immutable here";
    const std::string error = RestoreDatabase(file_, folder_ / "copy").status().ToString();
    ASSERT_TRUE(SetImmutable(folder_ / name, false));
    EXPECT_THAT(error, HasSubstr(std::string(name) + " cannot be copied or replaced")) << name;
    EXPECT_THAT(Names(), Not(Contains(HasSubstr("replace")))) << name;
    EXPECT_THAT(Names(), Not(Contains(HasSubstr("unfinished")))) << name;
    EXPECT_THAT(Labels(file_), ElementsAre("old")) << name;
  }
}

TEST_F(DatabaseRestoreTest, WhatAKilledRestoreHasCopiedIsRemovedByTheNext) {
  Put(file_, "old");
  Put(folder_ / "copy", "new");
  for (const char* name : {"restore", "restore-wal"}) {
    std::ofstream(UnfinishedCopy(file_, name)) << "a part";
  }
  std::ofstream(folder_ / "carillon.db.incoming") << "an operator's file";
  ASSERT_TRUE(RestoreDatabase(file_, folder_ / "copy").ok());
  EXPECT_THAT(Names(), Not(Contains(HasSubstr("-unfinished-"))));
  EXPECT_THAT(Names(), Contains("carillon.db.incoming"));
  EXPECT_THAT(Labels(file_), ElementsAre("new"));
}

TEST_F(DatabaseRestoreTest, ABackupOfATruncatedDatabaseIsRefused) {
  Put(file_, "model");
  const auto database = *ModeDatabase::Open(file_, clock_);
  const auto back_up = [&] {
    return BackUp(database->database(), folder_ / "copy", [] { return true; }).ToString();
  };
  EXPECT_EQ(back_up(), "OK");
  std::filesystem::remove(folder_ / "copy");
  std::filesystem::resize_file(file_, std::filesystem::file_size(file_) / 2);
  EXPECT_THAT(back_up(), HasSubstr("DATABASE_CORRUPT: "));
}

}  // namespace
}  // namespace carillon
