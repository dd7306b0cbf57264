// SPDX-License-Identifier: AGPL-3.0-or-later
//
// The files that carillon-precompute reads and writes.
#include <sys/stat.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include "tests/precompute/carillon_precompute_run.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ProgramFilesTest = CarillonPrecomputeTest;

TEST_F(ProgramFilesTest, ModelFileIsTheStoredForm) {
  const Json report = ReportOfBar("");
  const auto stored = ReadStored<v1::ModalModelHeader, v1::ModalModelRecord>(model);
  const v1::ModalModelHeader& header = stored.header;
  EXPECT_EQ(header.format_version(), 1u);
  EXPECT_EQ(header.mode_count(), report.at("modes").size());
  EXPECT_EQ(header.settings().element(), v1::ELEMENT_LINEAR);
  EXPECT_EQ(header.settings().metres_per_unit(), 0.001);
  EXPECT_EQ(header.mesh_digest().size(), 64u);
  EXPECT_NEAR(header.volume_m3(), 0.1 * 0.02 * 0.012, 1e-12);
  EXPECT_EQ(header.verification().sturm_count(), 6 + header.mode_count());
  std::vector<std::string> names;
  for (int i = 0; i < header.arrays_size(); ++i) {
    const v1::ArrayDescriptor& array = header.arrays(i);
    names.push_back(array.name());
    size_t bytes = array.type() == v1::ELEMENT_TYPE_FLOAT64 ? 8 : 4;
    for (const uint64_t extent : array.shape()) bytes *= extent;
    EXPECT_EQ(stored.arrays.at(array.name()).size(), bytes) << array.name();
  }
  EXPECT_THAT(names, ElementsAre("eigenvalues", "residuals", "couplings", "vertices", "triangles",
                                 "given_triangle", "given_vertices", "given_triangles", "shapes"));
  const double first = stored.Values<double>("eigenvalues")[0];
  EXPECT_NEAR(std::sqrt(first * 210e9 / 7850) / (2 * std::numbers::pi),
              report.at("modes")[0].at("frequency_hz").get<double>(), 1e-6);
}

TEST_F(ProgramFilesTest, AMeshMayComeFromAPipe) {
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { WriteBox(pipe, {100, 20, 12}); });
  EXPECT_EQ(Run(pipe + " --out " + model + " --format obj --unit mm --nodes 100 --json" + kSteel)
                .exit_status,
            0);
  writer.join();
  EXPECT_TRUE(std::filesystem::exists(model));
}

TEST_F(ProgramFilesTest, ADeviceIsWrittenToAndALinkStays) {
  const std::string pipe = folder + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::vector<v1::ModalModelRecord> records;
  std::thread reader([&] { records = ReadRecords(pipe); });
  const std::string small = bar + " --unit mm --element linear --nodes 100" + kSteel;
  EXPECT_EQ(Run(small + " --out " + pipe).exit_status, 0);
  reader.join();
  EXPECT_FALSE(records.empty());
  EXPECT_TRUE(std::filesystem::is_fifo(pipe));
  const std::string link = folder + "/link";
  std::ofstream(folder + "/target").close();
  std::filesystem::create_symlink("target", link);
  EXPECT_EQ(Run(small + " --out " + link).exit_status, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_GT(std::filesystem::file_size(folder + "/target"), 0);
}

}  // namespace
}  // namespace carillon::precompute
