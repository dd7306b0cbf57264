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
    database_ = *ModeDatabase::Open(file_, clock_);
  }

  absl::Status PutModel(const std::string& digest, const ModalModel& model,
                        const std::string& label = "") {
    const std::filesystem::path file = folder_ / ("model " + digest);
    WriteRecords(file, SampleRecords(model));
    absl::Status status = database_->models().PutFile(digest, label, file).status();
    std::filesystem::remove(file);
    return status;
  }

  /// Stores a model under the digest of a name.
  absl::Status Put(const std::string& name, const ModalModel& model = SampleModel(20, 100)) {
    return PutModel(Sha256Hex(name), model, name);
  }

  bool Has(const std::string& name) { return database_->models().Find(Sha256Hex(name)).ok(); }

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
