// SPDX-License-Identifier: Apache-2.0
//
// The disk fails at every access there is, one after the other.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "server/base/sha256.h"
#include "server/mode_database/database.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/faulty_vfs.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;

class DiskFaultTest : public ::testing::TestWithParam<DiskFault> {
 protected:
  DiskFaultTest() {
    EXPECT_TRUE(Open().ok());
    WriteRecords(folder_ / "model", SampleRecords(SampleModel(20, 100)));
    EXPECT_TRUE(Put("kept").ok());
  }

  absl::Status Open() {
    database_.reset();
    auto opened = ModeDatabase::Open(file_, clock_);
    absl::Status status = opened.status();
    if (status.ok()) database_ = *std::move(opened);
    return status;
  }

  absl::Status Put(const std::string& name) {
    return database_->models().PutFile(Sha256Hex(name), name, folder_ / "model").status();
  }

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
      EXPECT_TRUE(database_->models().Find(Sha256Hex("kept")).ok()) << "access " << good_count;
      if (!failed || HasFailure()) return good_count;
    }
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "carillon.db";
  const FaultyDisk disk_;
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_;
};

TEST_P(DiskFaultTest, WhatCannotBeStoredIsAnErrorAndTheDatabaseStaysWhole) {
  const auto is_there = [&] { return database_->models().Find(Sha256Hex("new")).status(); };
  int64_t failures = FailAtEveryAccess([&] {
    const absl::Status status = Put("new");
    const bool told = FaultyDisk::Repair();
    // An error means that nothing is there, success that all is.
    EXPECT_EQ(status.ok(), is_there().ok()) << status;
    const absl::Status removed = database_->models().Delete(Sha256Hex("new"));
    EXPECT_EQ(removed.ok(), status.ok()) << removed;
    return told ? status : absl::OkStatus();
  });
  EXPECT_GE(failures, 0);
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

std::string NameOf(const ::testing::TestParamInfo<DiskFault>& fault) {
  switch (fault.param) {
    case DiskFault::kFull:
      return "Full";
    case DiskFault::kReadOnly:
      return "ReadOnly";
    default:
      return "WriteError";
  }
}

INSTANTIATE_TEST_SUITE_P(Disk, DiskFaultTest,
                         ::testing::Values(DiskFault::kFull, DiskFault::kReadOnly,
                                           DiskFault::kWriteError),
                         NameOf);

class ReadErrorTest : public DiskFaultTest {};

TEST_P(ReadErrorTest, AModelThatCannotBeReadNowIsNotTakenForDamaged) {
  int quarantined = 0;
  database_->models().ListenToQuarantine([&](const auto&, const auto&) { ++quarantined; });
  ASSERT_TRUE(Open().ok());  // nothing of it in SQLite's own cache
  for (int64_t good_count = 0;; ++good_count) {
    ASSERT_TRUE(Open().ok());
    FaultyDisk::FailAfter(good_count, GetParam());
    const absl::Status status = database_->models().Find(Sha256Hex("kept")).status();
    if (!FaultyDisk::Repair()) break;
    EXPECT_THAT(status.ToString(), HasSubstr("DATABASE_IO_ERROR"));
  }
  EXPECT_EQ(quarantined, 0);
  EXPECT_TRUE(database_->models().Find(Sha256Hex("kept")).ok());
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

}  // namespace
}  // namespace carillon
