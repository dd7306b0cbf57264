// SPDX-License-Identifier: Apache-2.0
//
// Where the daemon keeps its data, and whether and how it writes to the journal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <latch>
#include <optional>
#include <thread>

#include "server/daemon/data_directory.h"
#include "server/daemon/journal_fields.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using testing::ElementsAre;

TEST(DataDirectory, IsMadeForItsOwnerOnly) {
  const TemporaryFolder folder;
  ASSERT_TRUE(DataDirectory::Open(folder / "a/b").ok());
  EXPECT_EQ(std::filesystem::status(folder / "a/b").permissions(),
            std::filesystem::perms::owner_all);
}

TEST(DataDirectory, WaitsForOneThatIsBeingGivenUp) {
  const TemporaryFolder folder;
  // In most rounds the other thread tries while the first still has the folder.
  for (int round = 0; round < 20; ++round) {
    std::optional<absl::StatusOr<DataDirectory>> first = DataDirectory::Open(folder / "data");
    ASSERT_TRUE(first->ok());
    std::latch begun(1);
    std::thread other([&] {
      begun.count_down();
      EXPECT_TRUE(DataDirectory::Open(folder / "data").ok());
    });
    begun.wait();
    std::this_thread::yield();
    first.reset();
    other.join();
  }
}

TEST(JournalFields, AnEventHasItsLineItsLevelItsNameAndItsFields) {
  const Event event =
      Event("job_failed", LogLevel::kWarning).With("transfer_of", "a b").With("n", 7);
  EXPECT_THAT(JournalFields(event),
              ElementsAre("MESSAGE=job_failed transfer_of=\"a b\" n=7", "PRIORITY=4",
                          "SYSLOG_IDENTIFIER=carillond", "CARILLON_EVENT=job_failed",
                          "CARILLON_TRANSFER_OF=a b", "CARILLON_N=7"));
}

TEST(JournalFields, ALineHasThePriorityOfItsLevel) {
  EXPECT_EQ(JournalFields(LogLevel::kDebug, "")[1], "PRIORITY=7");
  EXPECT_EQ(JournalFields(LogLevel::kInfo, "")[1], "PRIORITY=6");
  EXPECT_EQ(JournalFields(LogLevel::kWarning, "")[1], "PRIORITY=4");
  EXPECT_EQ(JournalFields(LogLevel::kError, "")[1], "PRIORITY=3");
}

TEST(JournalFields, TheJournalReadsTheFileThatJournalStreamNames) {
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  struct stat file {};
  ASSERT_EQ(fstat(pipe_ends[1], &file), 0);
  const std::string inode = std::to_string(file.st_ino);
  unsetenv("JOURNAL_STREAM");
  EXPECT_FALSE(IsJournal(pipe_ends[1]));
  setenv("JOURNAL_STREAM", (std::to_string(file.st_dev) + ":" + inode).c_str(), 1);
  EXPECT_TRUE(IsJournal(pipe_ends[1]));
  setenv("JOURNAL_STREAM", (std::to_string(file.st_dev) + ":" + inode + "0").c_str(), 1);
  EXPECT_FALSE(IsJournal(pipe_ends[1])) << "inherited from a service";
  unsetenv("JOURNAL_STREAM");
  close(pipe_ends[0]);
  close(pipe_ends[1]);
}

}  // namespace
}  // namespace carillon
