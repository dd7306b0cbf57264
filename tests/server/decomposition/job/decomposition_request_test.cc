// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/job/decomposition_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <set>

#include "absl/strings/str_cat.h"
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

// The text as every earlier version made it: a model that is stored keeps its name.
TEST(DecompositionRequest, ModelsKeepTheirNames) {
  Request request = Aluminum();
  v1::DecompositionSettings& settings = *request.mutable_settings();
  settings.set_poisson_ratio(-0.25);
  settings.set_element(v1::ELEMENT_LINEAR);
  settings.set_mass_matrix(v1::MASS_MATRIX_LUMPED);
  settings.set_metres_per_unit(0.0254);
  settings.mutable_mesh()->set_keep_surface(false);
  settings.mutable_mesh()->set_target_node_count(500);
  settings.mutable_mesh()->set_repair(true);
  settings.mutable_mesh()->set_wall_m(0.003);
  settings.mutable_mesh()->set_accuracy(0.01);
  settings.mutable_mesh()->set_budget_s(60);
  settings.mutable_mesh()->set_budget_gib(1.5);
  settings.set_keep_mode_count(2000);
  settings.add_fixtures()->set_group("rim");
  settings.add_fixtures()->mutable_vertices()->add_indices(3);
  EXPECT_EQ(CanonicalText(*ResolveRequest(request)),
            "carillon-decomposition 1\n"
            "mesh " +
                Sha256Hex("mesh") +
                "\n"
                "format obj\n"
                "poisson_1e-4 -2500\n"
                "element linear\n"
                "mass lumped\n"
                "metres_per_unit 0.0254\n"
                "keep_surface no\n"
                "target_node_count 500\n"
                "repair yes\n"
                "wall_m 0.003\n"
                "accuracy 0.01\n"
                "budget 60 1.5\n"
                "keep 2000\n"
                "fix group:rim\n"
                "fix vertices:3\n");
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
  Request request = Aluminum();
  request.mutable_settings()->add_fixtures()->mutable_plane()->mutable_normal()->set_z(2);
  EXPECT_THAT(CanonicalText(*ResolveRequest(request)), HasSubstr("\nfix plane:0,0,0/0,0,1\n"));
}

// A mode at the wanted eigenvalue, scaled to the material and size as modal_model.proto says,
// sounds at the maximal frequency.
TEST(DecompositionRequest, TheWantedEigenvalueScalesToTheMaximalFrequency) {
  Request request = Aluminum();
  request.set_size(2.5);
  request.set_max_frequency_hz(12'345);
  const auto resolved = ResolveRequest(request);
  ASSERT_TRUE(resolved.ok()) << resolved.status();
  const v1::Material& material = resolved->material();
  const double scaled = WantedEigenvalue(*resolved) * material.young_pa() /
                        (material.density_kg_per_m3() * 2.5 * 2.5);
  // Rounding only.
  EXPECT_NEAR(std::sqrt(scaled) / (2 * std::numbers::pi), 12'345, 1e-9);
}

TEST(DecompositionRequest, RefusesWhatCannotBeComputed) {
  const auto refusal = [](const std::function<void(Request&)>& change) {
    Request request = Aluminum();
    change(request);
    return ResolveRequest(request).status().ToString();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal([](Request& r) { r.set_mesh_format("step"); }),
              HasSubstr("MESH_FORMAT_UNKNOWN"));
  EXPECT_THAT(refusal([](Request& r) { r.set_mesh_digest("x\nformat obj"); }),
              HasSubstr("MESH_NOT_FOUND"));
  EXPECT_THAT(refusal([](Request& r) { r.mutable_material()->set_preset("cheese"); }),
              HasSubstr("UNKNOWN_MATERIAL"));
  EXPECT_THAT(refusal([](Request& r) { r.clear_material(); }), HasSubstr("INVALID_MATERIAL"));
  EXPECT_THAT(refusal([](Request& r) { r.mutable_settings()->add_fixtures(); }),
              HasSubstr("INVALID_SETTINGS: a fixture says nothing"));
  EXPECT_THAT(refusal([](Request& r) {
                for (int i = 0; i < 17; ++i) r.mutable_settings()->add_fixtures()->set_group("g");
              }),
              HasSubstr("INVALID_SETTINGS: there are 17 fixtures; at most 16"));
  EXPECT_THAT(refusal([](Request& r) { r.mutable_settings()->set_poisson_ratio(0.49999); }),
              HasSubstr("INVALID_SETTINGS"));
  EXPECT_THAT(refusal([](Request& r) { r.mutable_settings()->set_metres_per_unit(kNan); }),
              HasSubstr("INVALID_SETTINGS"));
  EXPECT_THAT(refusal([](Request& r) { r.set_size(-1); }), HasSubstr("INVALID_SETTINGS"));
  EXPECT_THAT(refusal([](Request& r) { r.set_max_frequency_hz(10); }),
              HasSubstr("INVALID_SETTINGS"));
}

}  // namespace
}  // namespace carillon
