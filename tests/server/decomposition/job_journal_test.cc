// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class JobJournalTest : public ::testing::Test {
 protected:
  /// Lets the database refuse, or take again, every new row of `table`.
  void Refuse(const std::string& table) {
    ASSERT_TRUE((*SqliteConnection::Open(folder_ / "carillon.db"))
                    ->Run(("CREATE TRIGGER refuse BEFORE INSERT ON " + table +
                           " BEGIN SELECT RAISE(ABORT, 'refused'); END")
                              .c_str())
                    .ok());
  }
  void TakeAgain() {
    ASSERT_TRUE(
        (*SqliteConnection::Open(folder_ / "carillon.db"))->Run("DROP TRIGGER refuse").ok());
  }

  TemporaryFolder folder_;
  SystemClock clock_;
  std::vector<std::string> lines_;
  std::unique_ptr<ModeDatabase> database_ = *ModeDatabase::Open(folder_ / "carillon.db", clock_);
  JobEvents events_{clock_, [this](const Event& event) { lines_.push_back(event.ToLine()); }};
  JobJournal journal_{*database_, events_};
};

TEST_F(JobJournalTest, WhatTheQueueCanDoWithoutIsLoggedIfTheDatabaseRefusesIt) {
  Refuse("jobs");
  journal_.Note({.digest = "d"});
  EXPECT_THAT(lines_, ElementsAre(StartsWith("job_not_stored what=job job=jobs/d message=")));
  EXPECT_FALSE(journal_.Put({.digest = "d"}).ok()) << "which the caller tells its client";
  EXPECT_EQ(lines_.size(), 1U);
  TakeAgain();
  journal_.Note({.digest = "d"});
  EXPECT_EQ(lines_.size(), 1U);
  EXPECT_TRUE((*database_->jobs().Find("d")).has_value());
}

TEST_F(JobJournalTest, ACoarseModelThatCannotBeCopiedIsLogged) {
  journal_.NoteCoarseModel("nothing", "fine", "bowl");
  EXPECT_THAT(lines_, ElementsAre(StartsWith("job_not_stored what=coarse_model job=jobs/fine ")));
}

TEST_F(JobJournalTest, TheNextDaemonReadsTheExperienceOfThisOne) {
  EXPECT_EQ(journal_.ReadExperience().correction(), 1);
  journal_.NoteExperience(MemoryExperience(1.25));
  EXPECT_EQ(journal_.ReadExperience().correction(), 1.25);
  EXPECT_THAT(lines_, IsEmpty());
}

TEST_F(JobJournalTest, TheNextDaemonReadsWhoWantsAJob) {
  ASSERT_TRUE(journal_.Put({.digest = "d"}, {"one"}).ok());
  ASSERT_TRUE(journal_.AddClient("d", "two").ok());
  ASSERT_TRUE(journal_.RemoveClient("d", "one").ok());
  EXPECT_THAT(journal_.ReadWishes("d").Wanting(), ElementsAre("two"));
}

}  // namespace
}  // namespace carillon
