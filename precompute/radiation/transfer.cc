// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/radiation/transfer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "precompute/radiation/far_pattern.h"
#include "precompute/radiation/mode_groups.h"
#include "precompute/radiation/solve_radiation.h"
#include "precompute/radiation/solve_time.h"
#include "precompute/radiation/spherical_harmonics.h"
#include "precompute/radiation/surface_levels.h"
#include "precompute/sparse/workers.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

/// Number of edges in a wavelength, in air and on the body, of the coarsest surface on which a mode
/// is solved.
constexpr double kEdgesPerAirWave = 2.2;
constexpr double kEdgesPerBodyWave = 3;
/// A mode whose normal motion has less than this fraction of the median mode's energy, such as
/// torsion, is almost silent. Its first surface depends on the wavelength in air only, and two
/// surfaces suffice.
constexpr double kWeakEnergy = 1e-2;
/// The goal for the error of directions, as a multiple of the goal for the error of the power.
constexpr double kDirectionGoal = 3;
/// The error stated for a mode that was solved on one surface only, if fewer than
/// kFewestChecked modes were solved on two.
constexpr double kUncheckedErrorDb = 6;
constexpr size_t kFewestChecked = 8;
/// The stated error of the finer of two surfaces, relative to the difference between both. If
/// differences halve from one surface to the next, this ratio is 1. Near a resonance of the air
/// inside the body, differences on coarse surfaces decrease more slowly, which needs a greater
/// ratio.
constexpr double kErrorPerDifference = 1.7;
/// The parts of the stated errors that are due to the solver, relative to its tolerance. They are
/// added to the parts that two surfaces show, because the surfaces may agree by chance.
constexpr double kPowerErrorDbPerTolerance = 10;
constexpr double kDirectionErrorDbPerTolerance = 15;
/// Approximate number of applications of the operator in a solution, used until a solution is
/// counted.
constexpr double kUsualSweeps = 10;

/// Errors in power and direction, dB.
struct ErrorDb {
  double power = kUncheckedErrorDb;
  double direction = kDirectionGoal * kUncheckedErrorDb;
};

/// Returns values at the vertices of one level, interpolated from the values on the level before.
std::vector<ComplexFloat> ValuesAt(const std::vector<SurfacePlace>& places,
                                   const std::vector<ComplexFloat>& values) {
  std::vector<ComplexFloat> result;
  result.reserve(places.size());
  for (const SurfacePlace& place : places) {
    ComplexFloat& sum = result.emplace_back(0);
    for (size_t c = 0; c < 3; ++c) {
      sum += static_cast<float>(place.weights[c]) * values[static_cast<size_t>(place.vertices[c])];
    }
  }
  return result;
}

class TransferSolver {
 public:
  TransferSolver(const SurfaceModes& modes, const RadiationSettings& settings,
                 const RadiationProgress& on_progress)
      : modes_(modes),
        settings_(settings),
        on_progress_(on_progress),
        workers_(settings.thread_count),
        body_(FindRadiatingSurface(modes)),
        levels_(body_, workers_),
        motions_(NormalMotions(modes, body_, workers_)) {
    transfer_ = {.settings = settings,
                 .center = body_.center,
                 .radius_m = body_.radius_m,
                 .modes = std::vector<ModeRadiation>(modes.mode_count()),
                 .rigid = {},
                 .cpu_s = 0};
    transfer_.rigid.mass = modes.mass_moments.size() == 10
                               ? FromMoments(modes.mass_moments.first<10>())
                               : ComputeMassProperties(modes.vertices, modes.triangles);
    std::vector<double> wavenumbers;
    for (size_t m = 0; m < modes.mode_count(); ++m) {
      wavenumbers.push_back(settings.speed_ratio * std::sqrt(std::max(0.0, modes.eigenvalues[m])));
      transfer_.modes[m].wavenumber = wavenumbers[m];
      transfer_.modes[m].normal_energy = motions_[m].energy;
    }
    groups_ = GroupModes(wavenumbers, settings.least_wavenumber, settings.greatest_wavenumber);
    const double weak = kWeakEnergy * MedianEnergy();
    for (ModeGroup& group : groups_) Prepare(weak, group);
  }

  absl::StatusOr<Transfer> Solve() && {
    RETURN_IF_ERROR(SolveRigid());
    // Solves all modes once on coarse surfaces, and then each mode on the next finer surface until
    // its goal is met, so that no mode takes the time of all others.
    bool any = true;
    while (any) {
      any = false;
      SortByNeed(groups_);
      for (ModeGroup& group : groups_) {
        if (!NeedsMore(group) || !IsAffordable(group)) continue;
        RETURN_IF_ERROR(SolveNext(group));
        any = true;
      }
    }
    EstimateUnchecked();
    for (const ModeGroup& group : groups_) {
      for (size_t s = 0; s < group.fields.size(); ++s) KeepField(group, s);
    }
    transfer_.cpu_s = CpuSeconds() - begun_s_;
    return std::move(transfer_);
  }

 private:
  double MedianEnergy() const {
    std::vector<double> energies;
    for (const ModeGroup& group : groups_) energies.push_back(motions_[group.modes[0]].energy);
    const auto middle = energies.begin() + static_cast<std::ptrdiff_t>(energies.size() / 2);
    std::nth_element(energies.begin(), middle, energies.end());
    return energies.empty() ? 0 : *middle;
  }

  /// Chooses the first level of a group. Modes with less energy than `weak` do not require a fine
  /// level.
  void Prepare(double weak, ModeGroup& group) {
    double edge_m = 2 * std::numbers::pi / group.wavenumber / kEdgesPerAirWave;
    for (const size_t m : group.modes) {
      transfer_.modes[m].in_band = true;
      if (motions_[m].energy > weak) {
        group.silent = false;
        edge_m = std::min(edge_m, motions_[m].wavelength_m / kEdgesPerBodyWave);
      }
      group.loudness = std::max(group.loudness, motions_[m].energy * motions_[m].energy);
    }
    group.first_level = levels_.LevelOf(edge_m);
    for (const int finer : {0, 1}) whole_pairs_ += PairsOf(group, group.first_level + finer);
  }

  /// Returns the number of pairs of vertices of one sweep for all right sides.
  double PairsOf(const ModeGroup& group, int level) const {
    const double n = levels_.VertexCountOf(level);
    return static_cast<double>(group.modes.size()) * n * n;
  }

  bool IsAffordable(const ModeGroup& group) const {
    const int level = group.next_level();
    if (!levels_.Exists(level)) return false;
    if (!(settings_.budget_cpu_s > 0)) return true;
    double sweeps = kUsualSweeps;
    for (const ModeField& field : group.fields) sweeps = std::max<double>(sweeps, field.iterations);
    double needed_s = SolveTime::OfSolution(sweeps * PairsOf(group, level));
    if (!levels_.IsMade(level)) needed_s += SolveTime::OfSurface(levels_.VertexCountOf(level));
    return time_.used_s() + needed_s <= settings_.budget_cpu_s;
  }

  bool NeedsMore(const ModeGroup& group) const {
    if (group.solved_count < 2) return true;
    return group.error_db > settings_.goal_db && !group.silent;
  }

  absl::StatusOr<const SurfaceLevels::Made*> LevelAt(int level) {
    if (levels_.IsMade(level)) return levels_.At(level);
    ASSIGN_OR_RETURN(const SurfaceLevels::Made* made, levels_.At(level));
    time_.Add(SolveTime::OfSurface(levels_.VertexCountOf(level)));
    return made;
  }

  absl::Status SolveRigid() {
    const double n = levels_.VertexCountOf(0);
    const double pairs = n * n * kUsualSweeps * kRigidMotionCount * kRigidWavenumberCount;
    const double needed_s = SolveTime::OfSolution(pairs) + SolveTime::OfSurface(n);
    if (settings_.budget_cpu_s > 0 && needed_s > settings_.budget_cpu_s / 4) {
      return absl::OkStatus();
    }
    ASSIGN_OR_RETURN(const SurfaceLevels::Made* made, LevelAt(0));
    transfer_.rigid =
        SolveRigidMotions(transfer_.rigid.mass, made->level, body_,
                          RigidWavenumbers(made->level, settings_.greatest_wavenumber), workers_);
    time_.Add(SolveTime::OfSolution(pairs));
    return absl::OkStatus();
  }

  absl::Status SolveNext(ModeGroup& group) {
    ASSIGN_OR_RETURN(const SurfaceLevels::Made* made, LevelAt(group.next_level()));
    const SphereGrid grid(PatternOrder(group.wavenumber, body_.radius_m));
    std::vector<ModeField> fields =
        SolveRadiation(ProblemOf(group, *made), made->level, body_, grid, workers_);
    // The right side and the far pattern take a sweep each.
    double sweeps = 2;
    for (const ModeField& field : fields) sweeps = std::max(sweeps, field.iterations + 2.0);
    const double pairs = PairsOf(group, group.next_level());
    time_.Add(SolveTime::OfSolution(pairs * sweeps));
    Compare(fields, grid, group);
    group.fields = std::move(fields);
    ++group.solved_count;
    if (group.solved_count <= 2) done_pairs_ += pairs;
    Report();
    return absl::OkStatus();
  }

  ModeProblem ProblemOf(const ModeGroup& group, const SurfaceLevels::Made& made) const {
    ModeProblem problem{.wavenumber = group.wavenumber, .tolerance = Tolerance()};
    for (size_t s = 0; s < group.modes.size(); ++s) {
      problem.displacements.push_back(DisplacementOf(modes_, group.modes[s], body_, made.level));
      if (group.solved_count > 0 && !made.places_before.empty()) {
        problem.starts.push_back(ValuesAt(made.places_before, group.fields[s].pressure));
      }
    }
    return problem;
  }

  /// The residual of a solution. A residual of 1e-2 leaves at most 0.1 dB of power and 0.15 dB of
  /// direction.
  double Tolerance() const { return settings_.goal_db < 0.3 ? 3e-3 : 1e-2; }

  /// Estimates the error of each mode from the difference between this level and the level before.
  void Compare(const std::vector<ModeField>& fields, const SphereGrid& grid, ModeGroup& group) {
    group.error_db = 0;
    group.loudness = 0;
    for (size_t s = 0; s < fields.size(); ++s) {
      ErrorDb error;
      if (group.solved_count > 0) error = ErrorOf(group.fields[s], fields[s], grid);
      if (group.solved_count == 1) first_differences_db_.push_back(error);
      ModeRadiation& mode = transfer_.modes[group.modes[s]];
      mode.power_error_db = error.power;
      mode.direction_error_db = error.direction;
      group.error_db = std::max({group.error_db, error.power, error.direction / kDirectionGoal});
      const double k = group.wavenumber;
      group.loudness =
          std::max(group.loudness, k * k * fields[s].power_integral * mode.normal_energy);
    }
  }

  ErrorDb ErrorOf(const ModeField& before, const ModeField& field, const SphereGrid& grid) const {
    const double power_db = std::abs(PowerDifferenceDb(before, field));
    const double direction_db = DirectionDifferenceDb(before.pattern, field.pattern, grid);
    return {.power = kPowerErrorDbPerTolerance * Tolerance() + kErrorPerDifference * power_db,
            .direction =
                kDirectionErrorDbPerTolerance * Tolerance() + kErrorPerDifference * direction_db};
  }

  /// Gives each mode that was solved on one surface only the largest error that the first surface
  /// had among the modes that were solved on two.
  void EstimateUnchecked() {
    if (first_differences_db_.size() < kFewestChecked) return;
    ErrorDb worst{.power = 0, .direction = 0};
    for (const ErrorDb& error : first_differences_db_) {
      worst.power = std::max(worst.power, error.power);
      worst.direction = std::max(worst.direction, error.direction);
    }
    for (const ModeGroup& group : groups_) {
      if (group.solved_count != 1) continue;
      for (const size_t m : group.modes) {
        transfer_.modes[m].power_error_db = worst.power;
        transfer_.modes[m].direction_error_db = worst.direction;
      }
    }
  }

  void KeepField(const ModeGroup& group, size_t side) {
    const ModeField& field = group.fields[side];
    ModeRadiation& mode = transfer_.modes[group.modes[side]];
    const int level = group.next_level() - 1;
    mode.computed = true;
    mode.power_integral = field.power_integral;
    mode.residual = field.residual;
    mode.surface_power_db = field.surface_power_db;
    mode.iterations = field.iterations;
    mode.edge_m = levels_.EdgeOf(level);
    mode.vertex_count = static_cast<int>(levels_.VertexCountOf(level));
    const SphereGrid grid(PatternOrder(group.wavenumber, body_.radius_m));
    ExpandPattern(field.pattern, grid, mode);
    const double left_out_db = DirectionDifferenceDb(KeptPattern(mode, grid), field.pattern, grid);
    mode.direction_error_db = std::hypot(mode.direction_error_db, left_out_db);
  }

  void Report() const {
    double done = whole_pairs_ > 0 ? done_pairs_ / whole_pairs_ : 1;
    if (settings_.budget_cpu_s > 0) done = std::max(done, time_.used_s() / settings_.budget_cpu_s);
    on_progress_(std::min(done, 1.0));
  }

  const SurfaceModes& modes_;
  RadiationSettings settings_;
  const RadiationProgress& on_progress_;
  const double begun_s_ = CpuSeconds();
  SolveTime time_;
  Workers workers_;
  RadiatingSurface body_;
  SurfaceLevels levels_;
  std::vector<NormalMotion> motions_;
  std::vector<ModeGroup> groups_;
  std::vector<ErrorDb> first_differences_db_;  ///< between the first two surfaces of each mode
  Transfer transfer_;
  double whole_pairs_ = 0;
  double done_pairs_ = 0;
};

}  // namespace

absl::StatusOr<Transfer> ComputeTransfer(const SurfaceModes& modes,
                                         const RadiationSettings& settings,
                                         const RadiationProgress& on_progress) {
  return TransferSolver(modes, settings, on_progress).Solve();
}

}  // namespace carillon::precompute
