// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/transfer.h"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>

#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/mode_solver.h"
#include "precompute/radiation/spherical_harmonics.h"
#include "precompute/radiation/surface_level.h"
#include "precompute/sparse/workers.h"

namespace carillon::precompute {
namespace {

/// The coarsest surface that a mode is tried on: edges to a wavelength in air and on the body, and
/// to the radius of the sphere around it.
constexpr double kEdgesPerAirWave = 2.2;
constexpr double kEdgesPerBodyWave = 3;
constexpr double kEdgesPerRadius = 9;
/// Levels are made with edges of radius / kEdgesPerRadius * 2^(-level / 2).
constexpr int kFinestLevel = 8;
/// Vertices of the finest surface that is made: a sweep then takes seconds.
constexpr double kMostVertices = 40000;
/// Directions may be off by so many times what the power may.
constexpr double kDirectionGoal = 3;
/// Modes whose wavenumbers differ by less, relatively, are solved at their mean.
constexpr double kPairWidth = 2e-3;
/// What is said of a mode that was solved on one surface only, where fewer than so many were solved
/// on two.
constexpr double kUncheckedErrorDb = 6;
constexpr size_t kFewestChecked = 8;
/// Nothing is known better than what the solver's tolerance and the far pattern's order leave.
constexpr double kLeastErrorDb = 0.05;
/// Harmonics weaker than this part of a mode's strongest, in power, are not kept.
constexpr double kKeptPower = 1e-4;
/// 0.05 dB.
constexpr double kPowerInOrder = 0.98855;

/// Applications of the operator that a solution takes, about, where none was counted.
constexpr double kUsualSweeps = 10;
/// Predictions of time where none was measured.
constexpr double kUsualSecondsPerPair = 1.5e-9;
constexpr double kUsualSetupSeconds = 2;

double CpuSeconds() {
  double seconds = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) {
      seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
  }
  return seconds;
}

double AreaM2(const SurfaceMesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    area += Norm(AreaNormal(CornersOf(mesh, t))) / 2;
  }
  return area;
}

/// Modes solved together, and the best that is known of them so far.
struct Group {
  std::vector<size_t> modes;  ///< one or two
  double wavenumber = 0;
  double loudness = 0;  ///< by what is known of it; only its order counts
  int first_level = 0;
  int solved_count = 0;           ///< levels from the first on that it was solved on
  std::vector<ModeField> fields;  ///< of the finest of them
  double error_db = 0;            ///< the worst of its modes; of directions over kDirectionGoal
  int next_level() const { return first_level + solved_count; }
};

/// A level, and where its vertices lie on the one before it (empty on the first).
struct MadeLevel {
  explicit MadeLevel(SurfaceLevel made) : level(std::move(made)), index(level.surface.mesh) {}

  SurfaceLevel level;
  NearestTriangle index;
  std::vector<SurfacePlace> places_before;
};

class TransferSolver {
 public:
  TransferSolver(const SurfaceModes& modes, const RadiationSettings& settings,
                 const RadiationProgress& on_progress)
      : modes_(modes),
        settings_(settings),
        on_progress_(on_progress),
        workers_(settings.thread_count),
        body_(FindRadiatingSurface(modes)),
        area_m2_(AreaM2(body_.mesh)),
        index_(body_.mesh),
        motions_(NormalMotions(modes, body_, workers_)) {
    transfer_ = {.settings = settings,
                 .center = body_.center,
                 .radius_m = body_.radius_m,
                 .modes = std::vector<ModeRadiation>(modes.mode_count()),
                 .cpu_s = 0};
    for (size_t m = 0; m < modes.mode_count(); ++m) {
      transfer_.modes[m].wavenumber = Wavenumber(m);
      transfer_.modes[m].normal_energy = motions_[m].energy;
    }
    MakeGroups();
  }

  absl::StatusOr<Transfer> Solve() && {
    // All modes once on coarse surfaces, then on finer ones until the goal is met.
    Sort();
    for (Group& group : groups_) {
      if (!IsAffordable(group)) continue;
      if (absl::Status status = SolveNext(group); !status.ok()) return status;
    }
    Sort();
    for (Group& group : groups_) {
      while (NeedsMore(group) && IsAffordable(group)) {
        if (absl::Status status = SolveNext(group); !status.ok()) return status;
      }
    }
    EstimateUnchecked();
    for (const Group& group : groups_) {
      for (size_t s = 0; s < group.fields.size(); ++s) KeepHarmonics(group, s);
    }
    transfer_.cpu_s = UsedSeconds();
    return std::move(transfer_);
  }

 private:
  /// Low modes first, which need the coarsest surfaces and ring longest; among those of one surface
  /// the loudest, as far as that is known.
  void Sort() {
    std::ranges::stable_sort(groups_, [](const Group& a, const Group& b) {
      return std::tuple(a.next_level(), -a.loudness) < std::tuple(b.next_level(), -b.loudness);
    });
  }

  /// Gives each mode that was solved on one surface only the largest error that the first surface
  /// had among the modes that were solved on two.
  void EstimateUnchecked() {
    if (first_differences_db_.size() < kFewestChecked) return;
    double power_db = 0;
    double direction_db = 0;
    for (const auto& [power, direction] : first_differences_db_) {
      power_db = std::max(power_db, power);
      direction_db = std::max(direction_db, direction);
    }
    for (const Group& group : groups_) {
      if (group.solved_count != 1) continue;
      for (const size_t m : group.modes) {
        transfer_.modes[m].power_error_db = power_db;
        transfer_.modes[m].direction_error_db = direction_db;
      }
    }
  }

  double Wavenumber(size_t m) const {
    return settings_.speed_ratio * std::sqrt(std::max(0.0, modes_.eigenvalues[m]));
  }

  void MakeGroups() {
    for (size_t m = 0; m < modes_.mode_count(); ++m) {
      const double k = Wavenumber(m);
      if (k < settings_.least_wavenumber || k > settings_.greatest_wavenumber || !(k > 0)) continue;
      transfer_.modes[m].in_band = true;
      const double before = groups_.empty() ? 0 : groups_.back().wavenumber;
      if (!groups_.empty() && groups_.back().modes.size() == 1 && k - before < kPairWidth * k) {
        groups_.back().modes.push_back(m);
        groups_.back().wavenumber = (before + k) / 2;
      } else {
        groups_.push_back({.modes = {m}, .wavenumber = k, .fields = {}});
      }
    }
    for (Group& group : groups_) {
      group.first_level = FirstLevel(group);
      for (const size_t m : group.modes) {
        group.loudness = std::max(group.loudness, motions_[m].energy * motions_[m].energy);
      }
      for (const int finer : {0, 1}) whole_pairs_ += PairsOf(group, group.first_level + finer);
    }
  }

  int FirstLevel(const Group& group) const {
    double edge_m = 2 * std::numbers::pi / group.wavenumber / kEdgesPerAirWave;
    for (const size_t m : group.modes) {
      edge_m = std::min(edge_m, motions_[m].wavelength_m / kEdgesPerBodyWave);
    }
    const double finer = 2 * std::log2(EdgeOf(0) / edge_m);
    return std::clamp(static_cast<int>(std::round(finer)), 0, kFinestLevel - 1);
  }

  double EdgeOf(int level) const {
    return body_.radius_m / kEdgesPerRadius * std::exp2(-0.5 * level);
  }

  /// As made, or predicted: half as many as there are equilateral triangles in the area.
  double VerticesOf(int level) const {
    const auto made = levels_.find(level);
    if (made != levels_.end()) {
      return static_cast<double>(made->second.level.surface.vertex_count());
    }
    return area_m2_ / (std::sqrt(3.0) / 2 * EdgeOf(level) * EdgeOf(level));
  }

  /// Pairs of vertices of one sweep for all sides.
  double PairsOf(const Group& group, int level) const {
    const double n = VerticesOf(level);
    return static_cast<double>(group.modes.size()) * n * n;
  }

  double UsedSeconds() const { return CpuSeconds() - begun_s_; }

  bool IsAffordable(const Group& group) const {
    const int level = group.next_level();
    if (level > kFinestLevel || VerticesOf(level) > kMostVertices) return false;
    if (!(settings_.budget_cpu_s > 0)) return true;
    double sweeps = kUsualSweeps;
    for (const ModeField& field : group.fields) sweeps = std::max<double>(sweeps, field.iterations);
    double needed_s = sweeps * PairsOf(group, level) * seconds_per_pair_;
    if (!levels_.contains(level)) needed_s += setup_s_;
    return UsedSeconds() + needed_s <= settings_.budget_cpu_s;
  }

  bool NeedsMore(const Group& group) const {
    if (group.solved_count == 0) return false;  // there was no time for it
    return group.solved_count == 1 || group.error_db > settings_.goal_db;
  }

  absl::StatusOr<const MadeLevel*> LevelAt(int level) {
    if (const auto made = levels_.find(level); made != levels_.end()) return &made->second;
    const double begun_s = CpuSeconds();
    absl::StatusOr<SurfaceLevel> surface = MakeSurfaceLevel(body_, index_, EdgeOf(level), workers_);
    if (!surface.ok()) return surface.status();
    MadeLevel& made = levels_.try_emplace(level, *std::move(surface)).first->second;
    if (const auto before = levels_.find(level - 1); before != levels_.end()) {
      made.places_before =
          PlacesOn(before->second.level.surface.mesh, before->second.index, made.level.surface);
    }
    setup_s_ = CpuSeconds() - begun_s;
    return &made;
  }

  absl::Status SolveNext(Group& group) {
    const absl::StatusOr<const MadeLevel*> made = LevelAt(group.next_level());
    if (!made.ok()) return made.status();
    const double begun_s = CpuSeconds();
    const SurfaceLevel& level = (*made)->level;
    ModeProblem problem{.wavenumber = group.wavenumber, .tolerance = Tolerance()};
    for (size_t s = 0; s < group.modes.size(); ++s) {
      problem.displacements.push_back(DisplacementOf(modes_, group.modes[s], body_, level));
      if (group.solved_count > 0 && !(*made)->places_before.empty()) {
        problem.starts.push_back(ValuesAt((*made)->places_before, group.fields[s].pressure));
      }
    }
    const SphereGrid grid(PatternOrder(group.wavenumber, body_.radius_m));
    std::vector<ModeField> fields = SolveModes(problem, level, body_, grid, workers_);
    double sweeps = 0;
    for (const ModeField& field : fields) sweeps = std::max<double>(sweeps, field.iterations);
    const double pairs = PairsOf(group, group.next_level());
    TakeTime(CpuSeconds() - begun_s, pairs * (sweeps + 2));
    Compare(fields, grid, group);
    group.fields = std::move(fields);
    ++group.solved_count;
    if (group.solved_count <= 2) done_pairs_ += pairs;
    Report();
    return absl::OkStatus();
  }

  /// A residual of 1e-2 leaves no more than 0.1 dB of power, and 0.3 dB of direction.
  double Tolerance() const { return settings_.goal_db < 1 ? 3e-3 : 1e-2; }

  static std::vector<ComplexFloat> ValuesAt(const std::vector<SurfacePlace>& places,
                                            const std::vector<ComplexFloat>& values) {
    std::vector<ComplexFloat> result;
    result.reserve(places.size());
    for (const SurfacePlace& place : places) {
      ComplexFloat& sum = result.emplace_back(0);
      for (size_t c = 0; c < 3; ++c) {
        sum +=
            static_cast<float>(place.weights[c]) * values[static_cast<size_t>(place.vertices[c])];
      }
    }
    return result;
  }

  void TakeTime(double seconds, double pairs) {
    measured_s_ += seconds;
    measured_pairs_ += pairs;
    seconds_per_pair_ = measured_s_ / measured_pairs_;
  }

  /// Takes the difference from the level before as the error.
  void Compare(const std::vector<ModeField>& fields, const SphereGrid& grid, Group& group) {
    group.error_db = 0;
    group.loudness = 0;
    for (size_t s = 0; s < fields.size(); ++s) {
      ModeRadiation& mode = transfer_.modes[group.modes[s]];
      mode.power_error_db = kUncheckedErrorDb;
      mode.direction_error_db = kDirectionGoal * kUncheckedErrorDb;
      if (group.solved_count > 0) {
        const double power = std::abs(PowerDifferenceDb(group.fields[s], fields[s]));
        const double direction = DirectionDifferenceDb(group.fields[s], fields[s], grid);
        mode.power_error_db = std::max(kLeastErrorDb, power);
        mode.direction_error_db = std::max(kDirectionGoal * kLeastErrorDb, direction);
        if (group.solved_count == 1) {
          first_differences_db_.emplace_back(mode.power_error_db, mode.direction_error_db);
        }
      }
      group.error_db =
          std::max({group.error_db, mode.power_error_db, mode.direction_error_db / kDirectionGoal});
      const double k = group.wavenumber;
      group.loudness =
          std::max(group.loudness, k * k * fields[s].power_integral * mode.normal_energy);
    }
  }

  void KeepHarmonics(const Group& group, size_t side) {
    const ModeField& field = group.fields[side];
    ModeRadiation& mode = transfer_.modes[group.modes[side]];
    const int level = group.next_level() - 1;
    mode.computed = true;
    mode.power_integral = field.power_integral;
    mode.residual = field.residual;
    mode.surface_power_db = field.surface_power_db;
    mode.iterations = field.iterations;
    mode.edge_m = EdgeOf(level);
    mode.vertex_count = static_cast<int>(VerticesOf(level));
    ExpandPattern(field.pattern, SphereGrid(PatternOrder(group.wavenumber, body_.radius_m)), mode);
  }

  void Report() const {
    double done = whole_pairs_ > 0 ? done_pairs_ / whole_pairs_ : 1;
    if (settings_.budget_cpu_s > 0) done = std::max(done, UsedSeconds() / settings_.budget_cpu_s);
    on_progress_(std::min(done, 1.0));
  }

  const SurfaceModes& modes_;
  RadiationSettings settings_;
  const RadiationProgress& on_progress_;
  double begun_s_ = CpuSeconds();
  Workers workers_;
  RadiatingSurface body_;
  double area_m2_;
  NearestTriangle index_;
  std::vector<NormalMotion> motions_;
  std::map<int, MadeLevel> levels_;
  std::vector<Group> groups_;
  /// In power and direction, between the first two surfaces of each mode.
  std::vector<std::pair<double, double>> first_differences_db_;
  Transfer transfer_;
  double whole_pairs_ = 0, done_pairs_ = 0;
  double measured_s_ = 0, measured_pairs_ = 0;
  double seconds_per_pair_ = kUsualSecondsPerPair;
  double setup_s_ = kUsualSetupSeconds;
};

}  // namespace

double ModeRadiation::efficiency() const {
  return normal_energy > 0 ? wavenumber * wavenumber * power_integral / normal_energy : 0;
}

double ModeRadiation::DecayRatePerS(const Air& air) const {
  return air.density_kg_per_m3 * air.sound_speed_m_per_s * wavenumber * wavenumber *
         power_integral / 2;
}

void ExpandPattern(std::span<const std::complex<double>> pattern, const SphereGrid& grid,
                   ModeRadiation& mode) {
  const std::vector<std::complex<double>> all = grid.Analyse(pattern);
  double whole = 0, strongest = 0;
  for (const auto& p : all) {
    whole += std::norm(p);
    strongest = std::max(strongest, std::norm(p));
  }
  double within = 0, kept = 0;
  for (mode.order = 0; mode.order <= grid.order(); ++mode.order) {
    for (int m = -mode.order; m <= mode.order; ++m) {
      within += std::norm(all[HarmonicIndex(mode.order, m)]);
    }
    if (within >= kPowerInOrder * whole) break;
  }
  std::complex<double> turn(0, mode.wavenumber);  // k i^(l + 1)
  for (int l = 0; l <= mode.order; ++l, turn *= std::complex<double>(0, 1)) {
    for (int m = -l; m <= l; ++m) {
      const size_t i = HarmonicIndex(l, m);
      if (std::norm(all[i]) < kKeptPower * strongest) continue;
      kept += std::norm(all[i]);
      mode.index.push_back(static_cast<uint32_t>(i));
      mode.value.emplace_back(turn * all[i]);
    }
  }
  const auto scale = static_cast<float>(kept > 0 ? std::sqrt(mode.power_integral / kept) : 0);
  for (std::complex<float>& value : mode.value) value *= scale;
}

absl::StatusOr<Transfer> ComputeTransfer(const SurfaceModes& modes,
                                         const RadiationSettings& settings,
                                         const RadiationProgress& on_progress) {
  return TransferSolver(modes, settings, on_progress).Solve();
}

}  // namespace carillon::precompute
