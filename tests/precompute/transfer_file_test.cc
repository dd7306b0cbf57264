// SPDX-License-Identifier: AGPL-3.0-or-later
//
// carillon-precompute --transfer as users run it, and the file that it writes.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "carillon/v1/transfer.pb.h"
#include "proto/cpp/transfer_format.h"
#include "tests/precompute/carillon_precompute_run.h"

namespace carillon::precompute {
namespace {

constexpr double kDensity = 7850, kYoung = 210e9, kSize = 2;
constexpr char kUse[] = " --young 210e9 --poisson 0.3 --density 7850 --size 2 --band 20:8000 ";

Stored<v1::TransferHeader> ReadTransfer(const std::string& path) {
  return ReadStored<v1::TransferHeader, v1::TransferRecord>(path);
}

struct TransferFileTest : CarillonPrecomputeTest {
  /// Decomposes the bar of steel, twice as large, with its radiation.
  Json Transfer(const std::string& options) const {
    return Report(bar + " --out " + model + " --unit mm --nodes 150 --transfer" + kUse + options);
  }
};

TEST_F(TransferFileTest, HoldsWhatTheReportSaysAndTheMassAndRigidMotionsOfTheBody) {
  const Json report = Transfer("");
  const auto stored = ReadTransfer(model + ".transfer");
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

// Unit material: k = s sqrt(Lambda) is size times the wavenumber of the body as it sounds.
TEST_F(TransferFileTest, KeepsThePowerOfEachModeInItsHarmonics) {
  const Json report = Transfer("--transfer-out " + folder + "/elsewhere");
  const auto stored = ReadTransfer(folder + "/elsewhere");
  const auto power = stored.Values<float>("power_integrals");
  const auto first = stored.Values<uint32_t>("first");
  const auto harmonics = stored.Values<uint32_t>("harmonics");
  const auto orders = stored.Values<uint32_t>("orders");
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
    EXPECT_NEAR(sum / (k * k * power[m]), 1, 1e-5);
    ASSERT_LT(first[m], first[m + 1]);
    const std::span kept = std::span(harmonics).subspan(first[m], first[m + 1] - first[m]);
    EXPECT_TRUE(std::ranges::is_sorted(kept));
    EXPECT_LT(kept.back(), (orders[m] + 1) * (orders[m] + 1));
  }
}

TEST_F(TransferFileTest, SaysWhatItsBudgetLeftOut) {
  const Json report = Transfer("--transfer-budget 0.001");
  EXPECT_EQ(report.at("radiation").at("modes_computed"), 0);
  EXPECT_FALSE(report.at("modes")[0].at("radiation").at("computed").get<bool>());
  const auto stored = ReadTransfer(model + ".transfer");
  EXPECT_EQ(stored.header.warnings_size(), 1);
  EXPECT_EQ(stored.Values<float>("power_integrals")[0], 0);
  EXPECT_EQ(stored.Values<uint32_t>("states")[0], 2U);
}

TEST_F(TransferFileTest, IsTheSameWhetherTheModesAreComputedOrStored) {
  Transfer("--transfer-budget 1000");
  const std::string apart = folder + "/apart";
  const Json report = Report(model + " --radiate --out " + apart + kUse + "--transfer-budget 1000");
  const auto together = ReadTransfer(model + ".transfer");
  const auto stored = ReadTransfer(apart);
  EXPECT_TRUE(stored.arrays == together.arrays);
  EXPECT_EQ(stored.header.mesh_digest(), together.header.mesh_digest());
  EXPECT_EQ(stored.header.settings().SerializeAsString(),
            together.header.settings().SerializeAsString());
  EXPECT_EQ(report.at("radiation").at("modes_computed"), stored.header.computed_mode_count());
}

}  // namespace
}  // namespace carillon::precompute
