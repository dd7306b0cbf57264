// SPDX-License-Identifier: Apache-2.0
// Runs a fuzzer's target once for each file of its corpus.
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>

#include "tests/server/mode_database/sample_model.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace carillon {
namespace {

TEST(Fuzz, EveryFileOfTheCorpusIsReadOrRefused) {
  size_t count = 0;
  for (const auto& file : std::filesystem::directory_iterator(CARILLON_CORPUS)) {
    SCOPED_TRACE(file.path().string());
    const std::string bytes = ReadBytes(file.path());
    EXPECT_EQ(LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()),
              0);
    ++count;
  }
  EXPECT_GT(count, 0U);
}

}  // namespace
}  // namespace carillon
