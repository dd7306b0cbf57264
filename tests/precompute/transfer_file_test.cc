// SPDX-License-Identifier: AGPL-3.0-or-later
//
// carillon-precompute --transfer as users run it, and the file that it writes.
#include <fcntl.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <xxhash.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "carillon/v1/transfer.pb.h"
#include "proto/cpp/transfer_format.h"
#include "tests/precompute/test_meshes.h"

namespace carillon::precompute {
namespace {

using Json = nlohmann::json;

constexpr double kDensity = 7850, kYoung = 210e9, kSize = 2;
constexpr char kUse[] = " --young 210e9 --poisson 0.3 --density 7850 --size 2 --band 20:8000 ";

/// A stored transfer: its header, and the bytes of each array, whose hashes were checked.
struct StoredTransfer {
  v1::TransferHeader header;
  std::map<std::string, std::string> arrays;

  template <typename T>
  std::vector<T> Values(const std::string& name) const {
    const std::string& bytes = arrays.at(name);
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
};

StoredTransfer ReadTransfer(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY);
  google::protobuf::io::FileInputStream file(descriptor);
  StoredTransfer stored;
  v1::TransferRecord record;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&record, &file, nullptr)) {
    if (record.has_header()) stored.header = record.header();
    if (!record.has_chunk()) continue;
    const v1::ModalModelChunk& chunk = record.chunk();
    EXPECT_EQ(chunk.xxh3(), XXH3_64bits(chunk.data().data(), chunk.data().size()));
    const auto& array = stored.header.arrays(static_cast<int>(chunk.array()));
    EXPECT_EQ(chunk.offset(), stored.arrays[array.name()].size());
    stored.arrays[array.name()] += chunk.data();
  }
  close(descriptor);
  return stored;
}

/// A bar of 100 x 20 x 12 mm of steel, twice as large, decomposed with its radiation.
struct TransferFileTest : ::testing::Test {
  TransferFileTest() {
    std::filesystem::create_directories(folder);
    const SurfaceMesh box = MakeBoxSurface({0.1, 0.02, 0.012});
    std::ofstream file(folder + "/bar.obj");
    for (const auto& [x, y, z] : box.vertices) file << "v " << x << " " << y << " " << z << "\n";
    for (const auto& [a, b, c] : box.triangles) {
      file << "f " << a + 1 << " " << b + 1 << " " << c + 1 << "\n";
    }
  }
  ~TransferFileTest() override { std::filesystem::remove_all(folder); }

  Json Run(const std::string& options) const {
    return Execute(folder + "/bar.obj --out " + folder + "/bar.modes --nodes 150 --transfer" +
                   kUse + options);
  }

  /// What the program prints, as an object.
  static Json Execute(const std::string& options) {
    const std::string command =
        std::string(CARILLON_PRECOMPUTE) + " " + options + " --json 2> /dev/null";
    std::FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    std::array<char, 4096> buffer;
    while (const size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
      output.append(buffer.data(), count);
    }
    Json report = Json::parse(output);
    EXPECT_EQ(pclose(pipe) == 0, !report.contains("error"));
    return report;
  }

  std::string folder = ::testing::TempDir() + "/carillon_transfer_" + std::to_string(getpid());
};

TEST_F(TransferFileTest, HoldsWhatTheReportSays) {
  const Json report = Run("");
  const StoredTransfer stored = ReadTransfer(folder + "/bar.modes.transfer");
  const auto& header = stored.header;
  EXPECT_EQ(header.format_version(), 1U);
  EXPECT_EQ(header.mesh_digest().size(), 64U);
  EXPECT_NEAR(header.speed_ratio(), std::sqrt(kYoung / kDensity) / 343, 1e-9);
  EXPECT_NEAR(header.radius_m(), std::hypot(0.05, 0.01, 0.006), 1e-6);
  EXPECT_NEAR(header.center_m().x(), 0.05, 1e-6);
  EXPECT_EQ(header.computed_mode_count(), report.at("radiation").at("modes_computed"));
  EXPECT_LE(header.verification().max_residual(), 1e-2);
  EXPECT_LE(header.verification().max_power_error_db(), 2);

  const auto power = stored.Values<float>("power_integrals");
  ASSERT_EQ(power.size(), header.mode_count());
  ASSERT_EQ(header.arrays_size(), static_cast<int>(kTransferArrayCount));
  for (size_t i = 0; i < kTransferArrayCount; ++i) {
    EXPECT_EQ(header.arrays(static_cast<int>(i)).name(), kTransferArrays[i].name);
  }
  ASSERT_EQ(report.at("modes").size(), header.mode_count());
  for (size_t m = 0; m < power.size(); ++m) {
    const Json& mode = report.at("modes")[m];
    const double omega = 2 * std::numbers::pi * mode.at("frequency_hz").get<double>();
    const double k = omega / 343, true_integral = power[m] * kSize / kDensity;
    EXPECT_NEAR(mode.at("radiation").at("decay_rate_per_s").get<double>(),
                1.204 * 343 * k * k * true_integral / 2, 1e-4 * k * k * true_integral * 207);
    EXPECT_NEAR(mode.at("radiation").at("pressure_at_1m_pa").get<double>() /
                    (1.204 * omega * omega * std::sqrt(true_integral / (4 * std::numbers::pi))),
                1, 1e-4);
  }
}

// Unit material: k = s sqrt(Lambda) is size times the wavenumber of the body as it sounds.
TEST_F(TransferFileTest, KeepsThePowerOfEachModeInItsHarmonics) {
  const Json report = Run("--transfer-out " + folder + "/elsewhere");
  const StoredTransfer stored = ReadTransfer(folder + "/elsewhere");
  const auto power = stored.Values<float>("power_integrals");
  const auto first = stored.Values<uint32_t>("first");
  const auto harmonics = stored.Values<uint32_t>("harmonics");
  const auto coefficients = stored.Values<float>("coefficients");
  ASSERT_EQ(first.size(), power.size() + 1);
  ASSERT_EQ(first.back(), harmonics.size());
  ASSERT_EQ(coefficients.size(), 2 * harmonics.size());
  for (size_t m = 0; m < power.size(); ++m) {
    const double frequency_hz = report.at("modes")[m].at("frequency_hz");
    const double k = kSize * 2 * std::numbers::pi * frequency_hz / 343;
    double sum = 0;
    for (size_t i = 2 * first[m]; i < 2 * first[m + 1]; ++i) {
      sum += coefficients[i] * coefficients[i];
    }
    EXPECT_NEAR(sum / (k * k * power[m]), 1, 1e-4);
  }
}

TEST_F(TransferFileTest, HoldsTheMassOfTheBodyAndItsRigidMotions) {
  Run("");
  const StoredTransfer stored = ReadTransfer(folder + "/bar.modes.transfer");
  const auto& body = stored.header.rigid_body();
  EXPECT_NEAR(body.volume_m3() / (0.1 * 0.02 * 0.012), 1, 1e-4);
  EXPECT_NEAR(body.center_of_mass_m().x(), 0.05, 1e-5);
  EXPECT_NEAR(body.inertia_kg_m2(2) / (body.volume_m3() * (0.01 + 0.0004) / 12), 1, 1e-3);
  ASSERT_EQ(body.motions_size(), 6);
  for (const auto& motion : body.motions()) {
    EXPECT_EQ(motion.strengths_size(), 9);
    EXPECT_EQ(motion.power_integrals_size(), body.wavenumbers_size());
  }
  // A flat bar moves more air across its broad side: a^3 s of the l = 1 harmonics.
  const auto dipole = [&](int motion, int harmonic) {
    const auto& sphere = body.motions(motion);
    return std::abs(std::pow(sphere.radius_m(), 3) * sphere.strengths(harmonic));
  };
  EXPECT_GT(dipole(2, 2), dipole(1, 1));
  EXPECT_GT(dipole(1, 1), dipole(0, 3));
}

TEST_F(TransferFileTest, SaysWhatItsBudgetLeftOut) {
  const Json report = Run("--transfer-budget 0.001");
  EXPECT_EQ(report.at("radiation").at("modes_computed"), 0);
  EXPECT_FALSE(report.at("modes")[0].at("radiation").at("computed").get<bool>());
  const StoredTransfer stored = ReadTransfer(folder + "/bar.modes.transfer");
  EXPECT_EQ(stored.header.warnings_size(), 1);
  EXPECT_EQ(stored.Values<float>("power_integrals")[0], 0);
  EXPECT_EQ(stored.Values<uint32_t>("states")[0], 2U);
}

TEST_F(TransferFileTest, IsTheSameWhetherTheModesAreComputedOrStored) {
  Run("--transfer-budget 1000");
  const std::string apart = folder + "/apart";
  const Json report =
      Execute(folder + "/bar.modes --radiate --out " + apart + kUse + "--transfer-budget 1000");
  const StoredTransfer together = ReadTransfer(folder + "/bar.modes.transfer");
  const StoredTransfer stored = ReadTransfer(apart);
  EXPECT_TRUE(stored.arrays == together.arrays);
  EXPECT_EQ(stored.header.mesh_digest(), together.header.mesh_digest());
  EXPECT_EQ(stored.header.settings().SerializeAsString(),
            together.header.settings().SerializeAsString());
  EXPECT_EQ(report.at("radiation").at("modes_computed"), stored.header.computed_mode_count());
}

}  // namespace
}  // namespace carillon::precompute
