// SPDX-License-Identifier: Apache-2.0
//
// A copy takes the place of a database.

#include <algorithm>

#include "server/mode_database/database_files.h"
#include "server/mode_database/maintenance/database_admin.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/database_fixture.h"

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
