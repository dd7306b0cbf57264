// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "carillon/v1/modal_model.pb.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {

using Json = nlohmann::json;

inline constexpr char kSteel[] = " --young 210e9 --poisson 0.3 --density 7850";

inline void WriteBox(const std::string& path, const Point& sides) {
  const SurfaceMesh box = MakeBoxSurface(sides);
  std::ofstream file(path);
  for (const auto& [x, y, z] : box.vertices) file << "v " << x << " " << y << " " << z << "\n";
  for (const auto& [a, b, c] : box.triangles) {
    file << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
  }
}

/// Runs the program as users do: a process, its options, its output and its exit status.
struct CarillonPrecomputeTest : ::testing::Test {
  struct Result {
    int exit_status;
    std::string output;
  };

  CarillonPrecomputeTest() {
    std::filesystem::create_directories(folder);
    WriteBox(bar, {100, 20, 12});  // mm
  }
  ~CarillonPrecomputeTest() override { std::filesystem::remove_all(folder); }

  /// What the program prints to standard output, given these options.
  Result Run(const std::string& options) const {
    const std::string command =
        std::string(CARILLON_PRECOMPUTE) + " " + options + " --threads 1 2> " + folder + "/stderr";
    std::FILE* pipe = popen(command.c_str(), "r");
    Result result{.exit_status = -1, .output = {}};
    std::array<char, 4096> buffer;
    while (const size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
      result.output.append(buffer.data(), count);
    }
    result.exit_status = WEXITSTATUS(pclose(pipe));
    return result;
  }

  /// Decomposes the bar: linear and small.
  Result RunBar(const std::string& options) const {
    return Run(bar + " --out " + model + " --unit mm --element linear --nodes 100 --json " +
               options);
  }

  /// The reason of a refusal, checked to be given in every way.
  std::string ReasonOf(const Result& result) const {
    EXPECT_NE(result.exit_status, 0);
    EXPECT_FALSE(std::filesystem::exists(model));
    const Json error = Json::parse(result.output).at("error");
    EXPECT_FALSE(error.at("message").get<std::string>().empty());
    EXPECT_THAT(OnStandardError(), ::testing::HasSubstr(error.at("reason").get<std::string>()));
    return error.at("reason");
  }

  /// What the last run printed there.
  std::string OnStandardError() const {
    std::ifstream file(folder + "/stderr");
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::string folder = ::testing::TempDir() + "/carillon_precompute_" + std::to_string(getpid());
  std::string bar = folder + "/bar.obj";
  std::string model = folder + "/bar.modes";
};

inline std::vector<v1::ModalModelRecord> ReadRecords(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY);
  google::protobuf::io::FileInputStream file(descriptor);
  std::vector<v1::ModalModelRecord> records;
  v1::ModalModelRecord record;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&record, &file, nullptr)) {
    records.push_back(record);
  }
  close(descriptor);
  return records;
}

}  // namespace carillon::precompute
