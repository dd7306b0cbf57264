// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <fcntl.h>
#include <gmock/gmock.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xxhash.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "carillon/v1/modal_model.pb.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {

using Json = nlohmann::json;

inline constexpr char kSteel[] = " --young 210e9 --poisson 0.3 --density 7850";

/// A box as OBJ, from `low`, in a file that has `before` vertices already.
inline void AppendBox(std::ofstream& file, const Point& sides, const Point& low, int before) {
  const SurfaceMesh box = MakeBoxSurface(sides);
  for (const auto& [x, y, z] : box.vertices) {
    file << "v " << low[0] + x << " " << low[1] + y << " " << low[2] + z << "\n";
  }
  for (const auto& [a, b, c] : box.triangles) {
    file << "f " << a + 1 + before << " " << b + 1 + before << " " << c + 1 + before << "\n";
  }
}

inline void WriteBox(const std::string& path, const Point& sides) {
  std::ofstream file(path);
  AppendBox(file, sides, {0, 0, 0}, 0);
}

/// The messages of a file, one after the other.
template <typename Message>
std::vector<Message> ReadMessages(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY);
  google::protobuf::io::FileInputStream file(descriptor);
  std::vector<Message> messages;
  Message message;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&message, &file, nullptr)) {
    messages.push_back(message);
  }
  close(descriptor);
  return messages;
}

inline std::vector<v1::ModalModelRecord> ReadRecords(const std::string& path) {
  return ReadMessages<v1::ModalModelRecord>(path);
}

/// A stored model or transfer: its header, and the bytes of each array, whose hashes were checked.
template <typename Header>
struct Stored {
  Header header;
  std::map<std::string, std::string> arrays;

  template <typename T>
  std::vector<T> Values(const std::string& name) const {
    const std::string& bytes = arrays.at(name);
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
};

template <typename Header, typename Record>
Stored<Header> ReadStored(const std::string& path) {
  Stored<Header> stored;
  for (const Record& record : ReadMessages<Record>(path)) {
    if (record.has_header()) stored.header = record.header();
    if (!record.has_chunk()) continue;
    const v1::ModalModelChunk& chunk = record.chunk();
    EXPECT_LE(chunk.data().size(), size_t{1} << 20);
    EXPECT_EQ(chunk.xxh3(), XXH3_64bits(chunk.data().data(), chunk.data().size()));
    const auto& array = stored.header.arrays(static_cast<int>(chunk.array()));
    EXPECT_EQ(chunk.offset(), stored.arrays[array.name()].size());
    stored.arrays[array.name()] += chunk.data();
  }
  return stored;
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

  /// What a run that must end well prints as JSON.
  Json Report(const std::string& options) const {
    const Result result = Run(options + " --json");
    EXPECT_EQ(result.exit_status, 0) << result.output;
    return Json::parse(result.output);
  }

  /// Decomposes the bar: linear and small.
  Result RunBar(const std::string& options) const { return Run(small_bar + " --json " + options); }
  Json ReportOfBar(const std::string& options) const { return Report(small_bar + options); }

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
  std::string small_bar =
      bar + " --out " + model + " --unit mm --element linear --nodes 100" + kSteel + " ";
};

}  // namespace carillon::precompute
