// SPDX-License-Identifier: Apache-2.0
//
// The disk fails at every access there is, one after the other, or holds an access while others go
// on.

#include <atomic>
#include <chrono>
#include <functional>
#include <future>

#include "server/mode_database/database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/database_fixture.h"
#include "tests/server/mode_database/faulty_vfs.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

class DiskFaultTest : public DatabaseTest, public ::testing::WithParamInterface<DiskFault> {
 protected:
  DiskFaultTest() {
    Reopen();  // on the disk that fails
    EXPECT_TRUE(Put("kept").ok());
  }
  void TearDown() override { database_.reset(); }  // before its disk

  static bool SaysWhatTheDiskDid(const absl::Status& status) {
    const std::string text = status.ToString();
    for (const char* reason : {"DATABASE_FULL: ", "DATABASE_UNUSABLE: ", "DATABASE_IO_ERROR: "}) {
      if (text.find(reason) != std::string::npos) return true;
    }
    return false;
  }

  std::string IntegrityCheck() {
    std::string result;
    auto connection = SqliteConnection::Open(file_);
    const absl::Status status =
        (*connection)->Query("PRAGMA integrity_check", {}, [&](const SqlRow& row) {
          result += row.Text(0);
          return absl::OkStatus();
        });
    return status.ok() ? result : status.ToString();
  }

  // Runs `call` on disks that fail after 0, 1, 2... accesses until one does not fail any more, and
  // looks each time whether the caller was told and the database is whole. Returns how many failed.
  int64_t FailAtEveryAccess(const std::function<absl::Status()>& call) {
    for (int64_t good_count = 0;; ++good_count) {
      FaultyDisk::FailAfter(good_count, GetParam());
      const absl::Status status = call();
      const bool failed = FaultyDisk::Repair();
      if (!status.ok()) {
        EXPECT_TRUE(failed) << status;
        EXPECT_TRUE(SaysWhatTheDiskDid(status)) << "access " << good_count << ": " << status;
      }
      EXPECT_EQ(IntegrityCheck(), "ok") << "access " << good_count;
      EXPECT_TRUE(Has("kept")) << "access " << good_count;
      if (!failed || HasFailure()) return good_count;
    }
  }

  const FaultyDisk disk_;
};

TEST_P(DiskFaultTest, WhatCannotBeStoredIsAnErrorAndTheDatabaseStaysWhole) {
  int64_t failures = FailAtEveryAccess([&] {
    const absl::Status status = Put("new");
    const bool told = FaultyDisk::Repair();
    // An error means that nothing is there, success that all is.
    EXPECT_EQ(status.ok(), Has("new")) << status;
    const absl::Status removed = database_->models().Delete(Sha256Hex("new"));
    EXPECT_EQ(removed.ok(), status.ok()) << removed;
    return told ? status : absl::OkStatus();
  });
  EXPECT_GT(failures, 0);
}

TEST_P(DiskFaultTest, EveryWriteOfEveryCallMayFail) {
  int64_t failures = 0;
  const std::string kept = Sha256Hex("kept");
  failures += FailAtEveryAccess([&] { return Put("another"); });
  failures += FailAtEveryAccess(
      [&] { return database_->jobs().Put({.digest = kept, .request = "intent"}); });
  failures += FailAtEveryAccess([&] { return database_->meshes().Put("solid").status(); });
  failures += FailAtEveryAccess([&] {
    return database_->models().Update(kept, {.label = "b", .add_tags = {"bell"}}).status();
  });
  failures += FailAtEveryAccess([&] {
    const absl::Status status = database_->models().Delete(Sha256Hex("another"));
    return absl::IsNotFound(status) ? absl::OkStatus() : status;
  });
  RecordProperty("failed_accesses", static_cast<int>(failures));
  EXPECT_GT(failures, 20);
}

INSTANTIATE_TEST_SUITE_P(Disk, DiskFaultTest,
                         ::testing::Values(DiskFault::kFull, DiskFault::kReadOnly,
                                           DiskFault::kWriteError),
                         [](const auto& fault) {
                           return std::string(fault.param == DiskFault::kFull       ? "Full"
                                              : fault.param == DiskFault::kReadOnly ? "ReadOnly"
                                                                                    : "WriteError");
                         });

class ReadErrorTest : public DiskFaultTest {};

TEST_P(ReadErrorTest, AModelThatCannotBeReadNowIsNotTakenForDamaged) {
  int quarantined = 0;
  for (int64_t good_count = 0;; ++good_count) {
    Reopen();  // nothing of it in SQLite's own cache
    database_->models().ListenToQuarantine([&](const auto&, const auto&) { ++quarantined; });
    FaultyDisk::FailAfter(good_count, GetParam());
    const absl::Status status = database_->models().Find(Sha256Hex("kept")).status();
    if (!FaultyDisk::Repair()) break;
    EXPECT_THAT(status.ToString(), HasSubstr("DATABASE_IO_ERROR"));
  }
  EXPECT_EQ(quarantined, 0);
  EXPECT_TRUE(Has("kept"));
}

INSTANTIATE_TEST_SUITE_P(Disk, ReadErrorTest, ::testing::Values(DiskFault::kReadError));

TEST(TemporaryFolder, NeedsNoSpaceForAnyChange) {
  const TemporaryFolder folder;
  WriteRecords(folder / "model", SampleRecords(SampleModel(200, 5000)));
  const FaultyDisk disk;
  const SystemClock clock;
  FaultyDisk::SetTemporaryFolderFull(true);
  const std::unique_ptr<ModeDatabase> database = *ModeDatabase::Open(folder / "carillon.db", clock);
  ModelStore& models = database->models();
  const std::string a = Sha256Hex("a"), b = Sha256Hex("b");
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(models.PutFile(a, "a", folder / "model").status(), absl::OkStatus());
  }
  EXPECT_EQ(models.CopyIfAbsent(a, b, "b"), absl::OkStatus());
  EXPECT_EQ(models.Update(a, {.label = "c", .add_tags = {"bell", "bronze"}}).status(),
            absl::OkStatus());
  EXPECT_EQ(database->meshes().Put(std::string(4 << 20, 'x')).status(), absl::OkStatus());
  EXPECT_EQ(models.Delete(a), absl::OkStatus());
  EXPECT_EQ(models.Collect(0).status(), absl::OkStatus());
  EXPECT_EQ(database->meshes().Collect(std::chrono::milliseconds(-1)).status(), absl::OkStatus());
  EXPECT_EQ(database->database().Tidy(), absl::OkStatus());
}

// Only a call that waits for another takes this long.
constexpr std::chrono::seconds kDeadline(20);

/// Who waits while a model is read, and while its quarantine is told.
class ModelLoadingTest : public DatabaseTest {
 protected:
  ModelLoadingTest() {
    EXPECT_TRUE(PutModel(a_, model_).ok() && PutModel(b_, model_).ok());
    Reopen();  // on the disk that fails, and with nothing of them in SQLite's own cache
  }
  void TearDown() override { database_.reset(); }  // before its disk

  /// Changes a byte of the mode shapes of both models on the disk.
  void Damage() {
    database_.reset();
    std::string content = ReadBytes(file_);
    const std::string shapes(reinterpret_cast<const char*>(model_.shapes.data()), 64);
    size_t count = 0;
    for (size_t at = content.find(shapes); at != std::string::npos; at = content.find(shapes, at)) {
      content[at] ^= 1;
      ++count;
    }
    ASSERT_EQ(count, 2U);
    WriteBytes(file_, content);
    Reopen();
  }

  const ModalModel model_ = SampleModel(20, 100);
  const FaultyDisk disk_;
};

TEST_F(ModelLoadingTest, AModelThatIsBeingReadKeepsOnlyItsOwnReadersWaiting) {
  ModelStore& models = database_->models();
  std::future<bool> slow = std::async(std::launch::async, [&] {
    FaultyDisk::HoldReadsOfThisThread();
    return models.FindToSound(a_).ok();
  });
  ASSERT_TRUE(FaultyDisk::AwaitHeldRead());
  std::future<bool> same = std::async(std::launch::async, [&] { return models.Find(a_).ok(); });
  std::future<bool> others = std::async(std::launch::async, [&] {
    const bool found =
        models.Summary(a_).ok() && models.List({}, 0, "").ok() && models.FindToSound(b_).ok();
    return found && models.Collect(0)->model_count == 1;
  });
  EXPECT_EQ(others.wait_for(kDeadline), std::future_status::ready);
  EXPECT_EQ(same.wait_for(std::chrono::seconds(0)), std::future_status::timeout);
  FaultyDisk::ReleaseReads();
  EXPECT_TRUE(others.get());
  EXPECT_TRUE(same.get());
  EXPECT_TRUE(slow.get());
  // The collection has spared the model that was being read.
  EXPECT_TRUE(models.Summary(a_).ok());
  EXPECT_TRUE(absl::IsNotFound(models.Summary(b_).status()));
}

TEST_F(ModelLoadingTest, AModelIsSharedByAllWhoLoadItAtTheSameTime) {
  std::vector<std::future<std::shared_ptr<const ModalModel>>> loads;
  loads.reserve(4);
  for (int i = 0; i < 4; ++i) {
    loads.push_back(std::async(std::launch::async, [&] { return *database_->models().Find(a_); }));
  }
  const std::shared_ptr<const ModalModel> first = loads[0].get();
  for (int i = 1; i < 4; ++i) EXPECT_EQ(loads[i].get(), first);
}

TEST_F(ModelLoadingTest, EigenvaluesAreReadWithoutTheRest) {
  EXPECT_EQ(*database_->models().Eigenvalues(a_), model_.eigenvalues);
  Damage();
  EXPECT_EQ(*database_->models().Eigenvalues(a_), model_.eigenvalues);
  EXPECT_TRUE(absl::IsDataLoss(database_->models().Find(a_).status()));
  EXPECT_TRUE(absl::IsDataLoss(database_->models().Eigenvalues(a_).status()));
}

TEST_F(ModelLoadingTest, AListenerThatIsReplacedHasEnded) {
  Damage();
  std::promise<void> begun;
  std::promise<void> gate;
  std::atomic<bool> ended = false;
  database_->models().ListenToQuarantine([&](const std::string&, const absl::Status&) {
    begun.set_value();
    gate.get_future().wait();
    ended = true;
  });
  std::future<bool> find =
      std::async(std::launch::async, [&] { return database_->models().Find(a_).ok(); });
  begun.get_future().wait();
  std::future<bool> replace = std::async(std::launch::async, [&] {
    database_->models().ListenToQuarantine(nullptr);
    return ended.load();
  });
  EXPECT_EQ(replace.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  gate.set_value();
  EXPECT_TRUE(replace.get());
  EXPECT_FALSE(find.get());
  EXPECT_FALSE(database_->models().Find(b_).ok());
}

}  // namespace
}  // namespace carillon
