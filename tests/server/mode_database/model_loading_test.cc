// SPDX-License-Identifier: Apache-2.0
//
// Who waits while a model is read, and while its quarantine is told.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "server/base/sha256.h"
#include "server/mode_database/mode_database.h"
#include "server/mode_database/sqlite_connection.h"
#include "tests/server/mode_database/faulty_vfs.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {
namespace {

// Only a call that waits for another takes this long.
constexpr std::chrono::seconds kDeadline(20);

class ModelLoadingTest : public ::testing::Test {
 protected:
  ModelLoadingTest() {
    WriteRecords(folder_ / "model", SampleRecords(model_));
    Open();
    for (const std::string& digest : {a_, b_}) {
      EXPECT_TRUE(database_->models().PutFile(digest, "", folder_ / "model").ok());
    }
    Open();  // nothing of them in SQLite's own cache
  }

  void Open() {
    database_.reset();
    database_ = *ModeDatabase::Open(file_, clock_);
  }

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
    Open();
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "carillon.db";
  const std::string a_ = Sha256Hex("a");
  const std::string b_ = Sha256Hex("b");
  const ModalModel model_ = SampleModel(20, 100);
  const FaultyDisk disk_;
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_;
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
