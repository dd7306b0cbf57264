// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/clock.h"
#include "server/base/sha256.h"
#include "server/mode_database/mode_database.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {

/// A database in a folder of its own.
class DatabaseTest : public ::testing::Test {
 protected:
  DatabaseTest() { Reopen(); }

  void Reopen() {
    database_.reset();
    auto opened = ModeDatabase::Open(file_, clock_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    database_ = *std::move(opened);
  }

  absl::Status PutModel(const std::string& digest, const ModalModel& model,
                        const std::string& label = "") {
    WriteRecords(folder_ / "model", SampleRecords(model));
    return database_->models().PutFile(digest, label, folder_ / "model").status();
  }

  /// Flips one bit of the database file, in the first place that holds `bytes`.
  void FlipABitWithin(std::string_view bytes) {
    database_.reset();  // all of the log goes into the file
    std::string content = ReadBytes(file_);
    const size_t at = content.find(bytes);
    ASSERT_NE(at, std::string::npos);
    content[at] ^= 1;
    WriteBytes(file_, content);
    Reopen();
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "carillon.db";
  SystemClock clock_;
  std::unique_ptr<ModeDatabase> database_;
  const std::string a_ = Sha256Hex("a");
  const std::string b_ = Sha256Hex("b");
};

}  // namespace carillon
