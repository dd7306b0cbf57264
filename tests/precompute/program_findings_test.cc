// SPDX-License-Identifier: AGPL-3.0-or-later
//
// What the program warns of, refuses and advises, as users see it.
#include <sys/resource.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "tests/precompute/carillon_precompute_run.h"

namespace carillon::precompute {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

using ProgramFindingsTest = CarillonPrecomputeTest;

// A bar of 12 triangles has elements as long as itself, whose first modes are off by 20 %.
TEST_F(ProgramFindingsTest, AMeshOfFewElementsIsComparedWithAFinerOne) {
  WriteBox(bar, {500, 20, 10});
  const std::string options = bar + " --out " + model + " --unit mm" + kSteel;
  const Json fine = Report(options).at("modes");
  for (const char* few : {" --keep-surface", " --nodes 3", " --nodes 60"}) {
    const Json report = Report(options + few);
    EXPECT_THAT(report.at("warnings").dump(), HasSubstr("too few elements"));
    const Json& modes = report.at("modes");
    ASSERT_LT(modes.size(), fine.size());
    for (size_t m = 0; m < modes.size(); ++m) {
      const double truth = fine[m].at("frequency_hz");
      const double error = modes[m].at("frequency_hz").get<double>() / truth - 1;
      // The finer mesh of the comparison is not the finest.
      EXPECT_GT(1.05 * modes[m].at("estimated_error").get<double>() + 0.002, error) << few << m;
    }
  }
}

TEST_F(ProgramFindingsTest, OrdinaryMeshesAreNotCompared) {
  ASSERT_EQ(Run(bar + " --out " + model + " --unit mm --nodes 300" + kSteel).exit_status, 0);
  EXPECT_EQ(OnStandardError(), "");
}

// One millimetre: its first mode, far above the band, is found on the first mesh.
TEST_F(ProgramFindingsTest, ABodyWithoutAModeInTheBandIsRefusedAfterOneMesh) {
  WriteBox(bar, {1, 1, 1});
  ReasonOf(Run(bar + " --out " + model + " --unit mm --json" + kSteel));
  rusage children{};
  getrusage(RUSAGE_CHILDREN, &children);
  EXPECT_LT(children.ru_maxrss, 300 << 10);  // KiB; finer meshes took 2 GiB
}

TEST_F(ProgramFindingsTest, ALargeBodyIsMadeOfMetresOnlyIfTheUnitIsStated) {
  WriteBox(bar, {202, 20, 10});
  const std::string options =
      bar + " --out " + model + " --element linear --nodes 100 --json" + kSteel;
  const Result refused = Run(options);
  EXPECT_EQ(ReasonOf(refused), "MESH_UNIT_UNCLEAR");
  for (const Json& remedy : Json::parse(refused.output).at("error").at("remedies")) {
    EXPECT_EQ(remedy.at("option"), "--unit");
    const std::string unit = remedy.at("value");
    const Result made = Run(absl::StrCat(options, " --unit ", unit));
    ASSERT_EQ(made.exit_status, 0) << unit;
    std::filesystem::remove(model);
    const Json lengths = Json::parse(made.output).at("body").at("lengths_m");
    EXPECT_NEAR(lengths[0].get<double>(), 202 * std::stod(unit), 1e-6 * std::stod(unit));
  }
  WriteBox(bar, {5, 0.5, 0.2});
  const auto warns = [&](const std::string& unit) {
    return Json::parse(Run(options + unit).output).at("warnings").dump().find("5.029 m long") !=
           std::string::npos;
  };
  EXPECT_TRUE(warns(""));
  std::filesystem::remove(model);
  EXPECT_FALSE(warns(" --unit m"));
}

// Two closed boxes in a row, which share a face, and the one box that they are together.
TEST_F(ProgramFindingsTest, PartsThatShareAFaceAreOneBodyOfOneMaterial) {
  const auto first_hz = [&] {
    const Json report = Report(bar + " --out " + model + " --unit mm --nodes 300" + kSteel);
    std::filesystem::remove(model);
    return report.at("modes")[0].at("frequency_hz").get<double>();
  };
  WriteBox(bar, {200, 16, 10});
  const double whole_hz = first_hz();
  std::ofstream file(bar);
  for (int part = 0; part < 2; ++part) {
    file << "o part" << part << "\nusemtl colour" << part << "\n";
    AppendBox(file, {100, 16, 10}, {100.0 * part, 0, 0}, 8 * part);
  }
  file.close();
  EXPECT_NEAR(first_hz() / whole_hz, 1, 0.005) << "the estimated errors";
}

TEST_F(ProgramFindingsTest, TheRemediesOfTooManyModesWork) {
  const std::string options = bar + " --out " + model +
                              " --unit mm --json --element linear --nodes 1700 --size 300" + kSteel;
  const Result result = Run(options + " --band 20:1e9");
  EXPECT_EQ(ReasonOf(result), "TOO_MANY_MODES");
  const Json remedies = Json::parse(result.output).at("error").at("remedies");
  EXPECT_EQ(remedies.size(), 2U);  // most of the modes are those of the mesh, so that none are kept
  const std::string band = remedies.at(1).at("value");
  const double high_hz = std::stod(band);
  EXPECT_GT(high_hz, 20);
  EXPECT_LT(high_hz, 1e6);
}

TEST_F(ProgramFindingsTest, ASlenderBodyIsRefusedAsSlender) {
  WriteBox(bar, {1000, 1, 1});
  const Result result = Run(bar + " --out " + model + " --unit mm --json --band 2000" + kSteel);
  EXPECT_EQ(ReasonOf(result), "BODY_TOO_SLENDER");
}

TEST_F(ProgramFindingsTest, OnlyRemediesThatHelpAnOpenSurfaceAreOffered) {
  const auto options_of = [&] {
    const Result result = RunBar("");
    EXPECT_EQ(ReasonOf(result), "MESH_NOT_CLOSED");
    std::vector<std::string> options;
    const Json error = Json::parse(result.output).at("error");
    for (const Json& remedy : error.at("remedies")) {
      options.push_back(remedy.at("option"));
    }
    return options;
  };
  std::string box = (std::stringstream() << std::ifstream(bar).rdbuf()).str();
  box.resize(box.rfind("f "));
  std::ofstream(bar, std::ios::trunc) << box;
  EXPECT_THAT(options_of(), ElementsAre("--repair"));
  std::ofstream(bar, std::ios::trunc) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
  EXPECT_THAT(options_of(), ElementsAre("--wall"));
}

}  // namespace
}  // namespace carillon::precompute
