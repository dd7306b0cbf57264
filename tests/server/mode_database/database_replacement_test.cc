// SPDX-License-Identifier: Apache-2.0
//
// A database takes the place of another, by a repair or a restore that may be killed.

#include "server/mode_database/database_replacement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/database_admin.h"
#include "server/mode_database/mode_database.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using std::filesystem::path;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DatabaseReplacementTest : public ::testing::Test {
 protected:
  DatabaseReplacementTest() {
    WriteRecords(folder_ / "model", SampleRecords(SampleModel(20, 100)));
  }

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

  TemporaryFolder folder_;
  const path file_ = folder_ / "carillon.db";
  SystemClock clock_;
};

TEST_F(DatabaseReplacementTest, EveryDatabaseThatWasReplacedIsKept) {
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
  const auto damaged = RepairDatabase(file_, [](const std::string&) {});
  EXPECT_EQ(damaged->filename(), "carillon.db.damaged");
  EXPECT_EQ(RepairDatabase(file_, [](const std::string&) {})->filename(), "carillon.db.damaged-2");
  EXPECT_THAT(Labels(file_), ElementsAre("third"));
}

TEST_F(DatabaseReplacementTest, WhatAKilledProgramHasBegunIsCompletedAtTheNextStart) {
  // What the program had done when it was killed, after the marker had been written.
  const std::vector<std::function<void()>> steps = {
      [] {}, [this] { std::filesystem::create_hard_link(file_, folder_ / "carillon.db.replaced"); },
      [this] { std::filesystem::remove(folder_ / "carillon.db-wal"); },
      [this] { std::filesystem::rename(folder_ / "fresh", file_); },
      [this] { std::filesystem::rename(folder_ / "fresh-count", folder_ / "carillon.db-count"); }};
  for (size_t count = 1; count <= steps.size(); ++count) {
    for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
      if (entry.path().filename() != "model") std::filesystem::remove(entry.path());
    }
    Put(file_, "old");
    Put(folder_ / "fresh", "new");
    std::ofstream(folder_ / "carillon.db-replacement") << "fresh\ncarillon.db.replaced\n";
    for (size_t i = 0; i < count; ++i) steps[i]();
    EXPECT_THAT(Labels(file_), ElementsAre("new")) << count;
    EXPECT_THAT(Labels(folder_ / "carillon.db.replaced"), ElementsAre("old")) << count;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "carillon.db-replacement")) << count;
    EXPECT_THAT((*Database::Open(file_))->MissingChanges(), IsEmpty()) << count;
  }
}

TEST_F(DatabaseReplacementTest, ARepairKeepsWhatPrecedesTheCutOfAFile) {
  for (int i = 0; i < 40; ++i) Put(file_, std::to_string(i));
  const auto size = std::filesystem::file_size(file_);
  std::filesystem::resize_file(file_, size - size / 4);
  std::vector<std::string> findings;
  const auto kept =
      RepairDatabase(file_, [&](const std::string& line) { findings.push_back(line); });
  ASSERT_TRUE(kept.ok()) << kept.status();
  const size_t left = Labels(file_).size();
  EXPECT_GT(left, 10U);
  EXPECT_LT(left, 40U);
  EXPECT_THAT(findings, testing::Contains(HasSubstr("left out of models: ")));
}

TEST_F(DatabaseReplacementTest, ABackupOfATruncatedDatabaseIsRefused) {
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
