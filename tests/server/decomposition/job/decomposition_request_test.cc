// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/decomposition_request.h"

#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "server/base/sha256.h"

namespace carillon {
namespace {

using ::testing::HasSubstr;
using Request = v1::CreateModalModelRequest;

Request Aluminum() {
  Request request;
  request.set_mesh_digest(Sha256Hex("mesh"));
  request.set_mesh_format("obj");
  request.mutable_material()->set_preset("chime_aluminum");
  return request;
}

std::string Digest(const Request& request) {
  const auto resolved = ResolveRequest(request);
  EXPECT_TRUE(resolved.ok()) << resolved.status();
  return resolved.ok() ? RequestDigest(*resolved) : "";
}

// A model that an earlier version stored keeps its name, which is the digest of a text.
TEST(DecompositionRequest, ModelsKeepTheirNames) {
  Request request = Aluminum();
  ASSERT_TRUE(google::protobuf::TextFormat::MergeFromString(
      R"(poisson_ratio: -0.25 element: ELEMENT_LINEAR mass_matrix: MASS_MATRIX_LUMPED
         metres_per_unit: 0.0254 keep_mode_count: 2000
         mesh { keep_surface: false target_node_count: 500 repair: true wall_m: 0.003
                accuracy: 0.01 budget_s: 60 budget_gib: 1.5 }
         fixtures { group: "rim" } fixtures { vertices { indices: 3 } })",
      request.mutable_settings()));
  EXPECT_EQ(Digest(Aluminum()), "5b3ae2ca1bd5bfd03248657bbb9fd591ef3bcd67c8da19a6ecda716501c2a45a");
  EXPECT_EQ(Digest(request), "9bb5c442dd49d749643201224c506c4c70d09f90edff823058d4213708f5b0ac");
}

TEST(DecompositionRequest, PoissonsRatioIsRoundedToOneInTenThousand) {
  const auto digest = [](double poisson) {
    Request request = Aluminum();
    request.mutable_settings()->set_poisson_ratio(poisson);
    return Digest(request);
  };
  EXPECT_EQ(digest(0.33), digest(0.330049));
  EXPECT_NE(digest(0.33), digest(0.330051));
  EXPECT_NE(digest(0.33), digest(-0.33));
}

TEST(DecompositionRequest, EverySettingIsPartOfTheName) {
  const std::vector<std::function<void(Request&)>> changes = {
      [](Request&) {},
      [](Request& r) { r.set_mesh_digest(Sha256Hex("other")); },
      [](Request& r) { r.set_mesh_format("ply"); },
      [](Request& r) { r.mutable_settings()->set_poisson_ratio(0.1); },
      [](Request& r) { r.mutable_settings()->set_element(v1::ELEMENT_LINEAR); },
      [](Request& r) { r.mutable_settings()->set_mass_matrix(v1::MASS_MATRIX_LUMPED); },
      [](Request& r) { r.mutable_settings()->set_metres_per_unit(0.0254); },
      [](Request& r) { r.mutable_settings()->mutable_mesh()->set_keep_surface(true); },
      [](Request& r) { r.mutable_settings()->mutable_mesh()->set_keep_surface(false); },
      [](Request& r) { r.mutable_settings()->mutable_mesh()->set_target_node_count(500); },
      [](Request& r) { r.mutable_settings()->set_check_with(v1::SOLVER_SPECTRA); },
      [](Request& r) { r.mutable_settings()->set_max_frequency_error(0.02); },
      [](Request& r) { r.mutable_settings()->add_fixtures()->set_group("base"); },
      [](Request& r) { r.mutable_settings()->add_fixtures()->set_group("rim"); },
      [](Request& r) { r.mutable_settings()->add_fixtures()->mutable_vertices()->add_indices(0); }};
  std::set<std::string> digests;
  for (const auto& change : changes) {
    Request request = Aluminum();
    change(request);
    digests.insert(Digest(request));
  }
  EXPECT_EQ(digests.size(), changes.size());
}

TEST(DecompositionRequest, OrderAndRepetitionOfFixturesAreNoPartOfTheName) {
  const auto digest = [](const std::vector<std::string>& groups) {
    Request request = Aluminum();
    for (const std::string& group : groups) {
      request.mutable_settings()->add_fixtures()->set_group(group);
    }
    return Digest(request);
  };
  EXPECT_EQ(digest({"rim", "base"}), digest({"base", "rim", "base"}));
  EXPECT_NE(digest({"rim", "base"}), digest({"base"}));
}

// A mode at the wanted eigenvalue, scaled to the material and size as modal_model.proto says,
// sounds at the maximal frequency.
TEST(DecompositionRequest, TheWantedEigenvalueScalesToTheMaximalFrequency) {
  Request request = Aluminum();
  request.set_size(2.5);
  request.set_max_frequency_hz(12'345);
  const auto resolved = *ResolveRequest(request);
  const v1::Material& material = resolved.material();
  const double scaled =
      WantedEigenvalue(resolved) * material.young_pa() / (material.density_kg_per_m3() * 2.5 * 2.5);
  // Rounding only.
  EXPECT_NEAR(std::sqrt(scaled) / (2 * std::numbers::pi), 12'345, 1e-9);
}

TEST(DecompositionRequest, RefusesWhatCannotBeComputed) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::pair<const char*, std::function<void(Request&)>>> refused = {
      {"MESH_FORMAT_UNKNOWN", [](Request& r) { r.set_mesh_format("step"); }},
      {"MESH_NOT_FOUND", [](Request& r) { r.set_mesh_digest("x\nformat obj"); }},
      {"UNKNOWN_MATERIAL", [](Request& r) { r.mutable_material()->set_preset("cheese"); }},
      {"INVALID_MATERIAL", [](Request& r) { r.clear_material(); }},
      {"INVALID_SETTINGS: a fixture says nothing",
       [](Request& r) { r.mutable_settings()->add_fixtures(); }},
      {"INVALID_SETTINGS: there are 17 fixtures; at most 16",
       [](Request& r) {
         for (int i = 0; i < 17; ++i) r.mutable_settings()->add_fixtures()->set_group("g");
       }},
      {"INVALID_SETTINGS", [](Request& r) { r.mutable_settings()->set_poisson_ratio(0.49999); }},
      {"INVALID_SETTINGS", [](Request& r) { r.mutable_settings()->set_metres_per_unit(kNan); }},
      {"INVALID_SETTINGS", [](Request& r) { r.set_size(-1); }},
      {"INVALID_SETTINGS", [](Request& r) { r.set_max_frequency_hz(10); }}};
  for (const auto& [reason, change] : refused) {
    Request request = Aluminum();
    change(request);
    EXPECT_THAT(ResolveRequest(request).status().ToString(), HasSubstr(reason));
  }
}

}  // namespace
}  // namespace carillon
