// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "precompute/mesh/fill/tetrahedralize.h"
#include "precompute/modes/modal_model.h"
#include "server/synthesis/bank/oscillator_bank.h"
#include "tests/physics/natural_frequencies.h"
#include "tests/precompute/test_meshes.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr precompute::ElasticConstants kElastic{.young_pa = 1, .poisson_ratio = 0.37};

/// Acrylic, in which neighbouring modes overlap, so that they interfere for as long as they ring.
const SoundingMaterial kAcrylic{.young_pa = 3.2e9,
                                .density_kg_per_m3 = 1190,
                                .loss_factor = {{.frequency_hz = 1000, .loss_factor = 0.03}}};

/// A body around `center` with the modes that it has in acrylic up to 20 kHz.
struct Body {
  Body(const precompute::TetMesh& mesh, double center_m)
      : center(center_m),
        model(precompute::MakeModalModel(
            mesh, {}, kElastic,
            precompute::ModesOf(mesh, kElastic, 1, 20000 / std::sqrt(3.2e9 / 1190)))),
        shapes(model.shapes, model.vertices.size(), model.eigenvalues.size()),
        sounding(SelectSoundingModes({model.eigenvalues, model.couplings}, kAcrylic, 48000)) {}

  uint32_t Nearest(const std::array<double, 3>& point) const {
    const auto distance = [&](const std::array<float, 3>& v) {
      return std::hypot(v[0] - center - point[0], v[1] - center - point[1],
                        v[2] - center - point[2]);
    };
    return static_cast<uint32_t>(std::ranges::min_element(model.vertices, {}, distance) -
                                 model.vertices.begin());
  }

  double center;  // of each coordinate
  precompute::ModalModel model;
  ShapeTable shapes;
  SoundingModes sounding;
};

/// The energy, dB, of the sound of a strike on `direction` from the centre towards the centre.
double EnergyDb(const Body& body, const SoundingModes& sounding, std::array<double, 3> direction,
                double distance_m) {
  const double norm = std::hypot(direction[0], direction[1], direction[2]);
  SurfaceImpulse impulse{.at = {.weights = {1, 0, 0}}, .pulse = Pulse::RaisedCosine(1e-4F)};
  std::array<double, 3> point{};
  for (size_t axis = 0; axis < 3; ++axis) {
    point[axis] = direction[axis] / norm * distance_m;
    impulse.impulse_newton_seconds[axis] = static_cast<float>(-direction[axis] / norm);
  }
  impulse.at.vertices.fill(body.Nearest(point));
  OscillatorBank bank(sounding, body.shapes, {});
  return 20 * std::log10(Rms(Ring(bank, impulse, 24000)));
}

double SpreadDb(const std::vector<double>& levels_db) {
  const auto [least, most] = std::ranges::minmax(levels_db);
  return most - least;
}

/// Strikes the body on these directions, which are equal by symmetry, and expects equal levels of
/// the whole sound and of each multiplet by itself. Returns the sizes of the multiplets.
std::set<size_t> ExpectEqualLevels(const Body& body,
                                   const std::vector<std::array<double, 3>>& directions,
                                   double distance_m) {
  const auto levels_db = [&](const SoundingModes& sounding) {
    std::vector<double> levels;
    levels.reserve(directions.size());
    for (const auto& direction : directions) {
      levels.push_back(EnergyDb(body, sounding, direction, distance_m));
    }
    return levels;
  };
  const std::vector<double> whole = levels_db(body.sounding);
  EXPECT_LT(SpreadDb(whole), 0.2);
  std::set<size_t> sizes;
  for (size_t first = 0; first < body.sounding.modes.size();) {
    SoundingModes one{.modes = {}, .shape_scale = body.sounding.shape_scale};
    const uint32_t multiplet = body.sounding.modes[first].multiplet;
    while (first < body.sounding.modes.size() &&
           body.sounding.modes[first].multiplet == multiplet) {
      one.modes.push_back(body.sounding.modes[first++]);
    }
    if (multiplet == 0) continue;
    sizes.insert(one.modes.size());
    const std::vector<double> levels = levels_db(one);
    // Symmetry forbids some multiplets to move at these points, so that only errors of the mesh do.
    if (levels[0] < whole[0] - 30) continue;
    EXPECT_LT(SpreadDb(levels), 0.2) << one.modes[0].natural_frequency_hz << " Hz";
  }
  return sizes;
}

TEST(Multiplets, OfABallSoundEquallyLoudFromFourteenSides) {
  const Body body(*precompute::Tetrahedralize(precompute::MakeSphereSurface(0.04, 3),
                                              {.keep_surface = true, .target_node_count = 700}),
                  0);
  std::vector<std::array<double, 3>> directions;
  for (const double s : {-1.0, 1.0}) {
    directions.insert(directions.end(), {{s, 0, 0}, {0, s, 0}, {0, 0, s}});
    for (const double t : {-1.0, 1.0}) directions.insert(directions.end(), {{s, t, 1}, {s, t, -1}});
  }
  ASSERT_EQ(directions.size(), 14U);
  const std::set<size_t> sizes = ExpectEqualLevels(body, directions, 0.04);
  for (const size_t size : {3U, 5U, 7U}) EXPECT_TRUE(sizes.contains(size)) << size;
}

TEST(Multiplets, OfACubeSoundEquallyLoudFromItsTwelveEdges) {
  const Body body(precompute::MakeTetBox({0.05, 0.05, 0.05}, {8, 8, 8}, 10), 0.025);
  std::vector<std::array<double, 3>> directions;
  for (const double s : {-1.0, 1.0}) {
    for (const double t : {-1.0, 1.0}) {
      directions.insert(directions.end(), {{s, t, 0}, {0, s, t}, {t, 0, s}});
    }
  }
  ASSERT_EQ(directions.size(), 12U);
  EXPECT_TRUE(ExpectEqualLevels(body, directions, 0.05 * std::sqrt(0.5)).contains(3));
}

}  // namespace
}  // namespace carillon
