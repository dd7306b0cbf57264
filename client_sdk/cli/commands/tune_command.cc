// SPDX-License-Identifier: Apache-2.0
//
// `carillon model tune MODEL --to PITCH`
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/commands/mode_sound.h"
#include "client_sdk/cli/output/job_progress.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/program/escaped_text.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

using interchange::StoredModel;

/// A pitch is reached within this, a third of a cent, which is finer than an ear. Meshes of other
/// sizes may make steps that keep a body from it; a result within 5 cents is still told.
constexpr double kReached = 2e-4, kAcceptable = 3e-3;
constexpr int kMostSolves = 8;
/// The first probe changes the axis at least this much, so that the slope stands out of the
/// differences between two meshes; steps below a third of it do not change the slope.
constexpr double kLeastProbe = 0.03;
/// Axes are stretched or shortened by this factor at most.
constexpr double kMostScale = 5;
/// d ln f / d ln scale that is too little to tune by.
constexpr double kLeastSlope = 0.05;
/// The axes by which a body is longest and thinnest must be so by this factor.
constexpr double kDistinct = 1.001;
constexpr double kHighest_hz = 20'000;

double Cents(double hz, double wanted_hz) { return 1200 * std::log2(hz / wanted_hz); }

absl::Status NotReached(absl::string_view what) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "PITCH_NOT_REACHED", what);
}

/// The damped frequency of a mode, counted from 1, as an object of `size` sounds it.
absl::StatusOr<double> FrequencyOf(const v1::ModalModelSummary& model, const v1::Material& material,
                                   uint32_t mode, double size = 1) {
  const std::vector<ModeSound> modes = ModesOf(model, material, size);
  if (mode < 1 || mode > modes.size()) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("--mode ", mode, ": the model \"", EscapedText(model.label()),
                     "\" has the modes 1 to ", modes.size(), "; carillon model show lists them"));
  }
  const double hz = modes[mode - 1].damped_hz;
  if (hz > 0) return hz;
  return NotReached(absl::StrCat("mode ", mode,
                                 " is damped so much that it has no pitch; take another material"));
}

/// The solid that is stretched along one axis, and solved again.
class Body {
 public:
  Body(const client::Client& daemon, const v1::ModalModelSummary& model, v1::Material material,
       StoredModel surface)
      : daemon_(daemon),
        model_(model),
        material_(std::move(material)),
        surface_(std::move(surface)) {}

  /// Finds the axis of "length", "thickness", "x", "y" or "z".
  absl::Status ChooseAxis(const std::string& by) {
    std::array<double, 3> extents{};
    for (size_t a = 0; a < 3; ++a) extents[a] = Extent(a);
    if (by.size() == 1) {
      axis_ = static_cast<size_t>(by[0] - 'x');
      return absl::OkStatus();
    }
    std::array<size_t, 3> order = {0, 1, 2};
    std::ranges::sort(order, {}, [&](size_t a) { return extents[a]; });
    const bool length = by == "length";
    axis_ = length ? order[2] : order[0];
    const double ratio =
        length ? extents[order[2]] / extents[order[1]] : extents[order[1]] / extents[order[0]];
    if (ratio >= kDistinct) return absl::OkStatus();
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrFormat("--by %s: two axes of the file are as %s as each other (%.4g x "
                        "%.4g x %.4g m); give --by x, y or z",
                        by, length ? "long" : "thin", extents[0], extents[1], extents[2]));
  }

  double Extent(size_t axis) const {
    float low = HUGE_VALF, high = -HUGE_VALF;
    for (size_t i = axis; i < surface_.given_vertices.size(); i += 3) {
      low = std::min(low, surface_.given_vertices[i]);
      high = std::max(high, surface_.given_vertices[i]);
    }
    return double{high} - double{low};
  }

  size_t axis() const { return axis_; }
  double length_m() const { return Extent(axis_); }

  /// Returns the model of the body whose axis is `scale` times as long, and whether it was there
  /// before.
  absl::StatusOr<std::pair<v1::ModalModelSummary, bool>> Solve(double scale,
                                                               bool without_transfer) const {
    ASSIGN_OR_RETURN(std::string digest, daemon_.UploadMesh(Obj(scale)));
    v1::CreateModalModelRequest request;
    request.set_mesh_digest(std::move(digest));
    request.set_mesh_format("obj");
    ASSIGN_OR_RETURN(*request.mutable_settings(), Settings(scale));
    *request.mutable_material() = material_;
    const double complete_hz = CompleteToHz(model_, material_);
    // A model of a narrower band than the open one was asked for with that band.
    if (complete_hz < kHighest_hz && model_.header().lowered_from_mode_count() == 0) {
      request.set_max_frequency_hz(complete_hz / std::min(1.0, scale));
    }
    request.set_without_transfer(without_transfer);
    request.set_label(absl::StrCat(model_.label(), "_tuned"));
    ASSIGN_OR_RETURN(v1::Job job, daemon_.CreateModalModel(request));
    const bool was_there = job.state() == v1::JOB_STATE_SUCCEEDED;
    if (!was_there) {
      ASSIGN_OR_RETURN(job, WatchWithProgress(daemon_, job.name()));
    }
    ASSIGN_OR_RETURN(auto model, daemon_.GetModalModel(job.modal_model()));
    return std::pair(std::move(model), was_there);
  }

 private:
  std::string Obj(double scale) const {
    std::string text;
    for (size_t i = 0; i < surface_.given_vertices.size(); ++i) {
      const double factor = i % 3 == axis_ ? scale : 1;
      absl::StrAppendFormat(&text, "%s%.9g%s", i % 3 == 0 ? "v " : " ",
                            factor * double{surface_.given_vertices[i]}, i % 3 == 2 ? "\n" : "");
    }
    for (size_t i = 0; i < surface_.given_triangles.size(); ++i) {
      absl::StrAppendFormat(&text, "%s%d%s", i % 3 == 0 ? "f " : " ",
                            surface_.given_triangles[i] + 1, i % 3 == 2 ? "\n" : "");
    }
    return text;
  }

  void Stretch(v1::Vec3& vector, double factor) const {
    if (axis_ == 0) vector.set_x(vector.x() * factor);
    if (axis_ == 1) vector.set_y(vector.y() * factor);
    if (axis_ == 2) vector.set_z(vector.z() * factor);
  }

  /// The settings of the model, of which the regions that are fixed are stretched, too.
  absl::StatusOr<v1::DecompositionSettings> Settings(double scale) const {
    v1::DecompositionSettings settings = model_.header().settings();
    settings.set_metres_per_unit(1);
    for (v1::Fixture& fixture : *settings.mutable_fixtures()) {
      if (fixture.has_plane()) {
        Stretch(*fixture.mutable_plane()->mutable_point_m(), scale);
        Stretch(*fixture.mutable_plane()->mutable_normal(), 1 / scale);
      } else if (fixture.has_box()) {
        Stretch(*fixture.mutable_box()->mutable_low_m(), scale);
        Stretch(*fixture.mutable_box()->mutable_high_m(), scale);
      } else {
        return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                       "a body that is fixed at vertices or at a group of its file cannot be "
                       "stretched, because its model does not have them: create the model with a "
                       "plane or a box (--fix), or tune it --by size");
      }
    }
    return settings;
  }

  const client::Client& daemon_;
  const v1::ModalModelSummary& model_;
  const v1::Material material_;
  const StoredModel surface_;
  size_t axis_ = 0;
};

/// A body that was stretched along its axis, and the pitch that it has.
struct Tuned {
  double scale = 1;
  double hz = 0;
  v1::ModalModelSummary model;
  int solve_count = 0;
};

/// Stretches a body until a mode has its pitch, by secants of ln f over ln scale.
class Tuner {
 public:
  Tuner(const client::Client& daemon, const Body& body, const v1::Material& material,
        const TuneOptions& options)
      : daemon_(daemon), body_(body), material_(material), options_(options) {}

  /// `slope` is a guess of d ln f / d ln scale.
  absl::StatusOr<Tuned> Run(double slope) {
    RETURN_IF_ERROR(Try(1));
    bool known = false;
    while (std::abs(Miss(best_.hz)) > kReached && best_.solve_count < kMostSolves) {
      const double before_hz = last_hz_, before = last_scale_;
      double step = -Miss(best_.hz) / slope;
      if (!known && std::abs(step) < kLeastProbe) step = std::copysign(kLeastProbe, step);
      const double scale = best_.scale * std::exp(step);
      if (scale > kMostScale || scale < 1 / kMostScale) return Unreachable();
      RETURN_IF_ERROR(Try(scale));
      const double run = std::log(last_scale_ / before);
      if (std::abs(run) > kLeastProbe / 3)
        slope = std::log(last_hz_ / before_hz) / run, known = true;
      if (std::abs(slope) < kLeastSlope) return Unreachable();
    }
    if (std::abs(Miss(best_.hz)) > kAcceptable) return Unreachable();
    // The stretched body's transfer is computed, too, as for every model that is created.
    RETURN_IF_ERROR(body_.Solve(best_.scale, false).status());
    return std::move(best_);
  }

 private:
  double Miss(double hz) const { return std::log(hz / options_.to_hz); }

  absl::Status Unreachable() {
    (void)daemon_.DeleteModalModel(made_);
    return NotReached(absl::StrFormat(
        "mode %d came to %.5g Hz at %.4g times the length of the axis, not to %.5g Hz: tune --by "
        "another measure, or begin with a body nearer to the pitch",
        options_.mode, best_.hz, best_.scale, options_.to_hz));
  }

  /// Solves the body at a scale, and keeps the best model alone.
  absl::Status Try(double scale) {
    ASSIGN_OR_RETURN(auto solved, body_.Solve(scale, true));
    auto& [model, was_there] = solved;
    ASSIGN_OR_RETURN(last_hz_, FrequencyOf(model, material_, options_.mode));
    last_scale_ = scale;
    const bool better = best_.hz == 0 || std::abs(Miss(last_hz_)) < std::abs(Miss(best_.hz));
    const std::string worse = better      ? std::exchange(made_, was_there ? "" : model.name())
                                   : was_there ? ""
                                          : model.name();
    if (!worse.empty()) (void)daemon_.DeleteModalModel(worse);
    if (better) best_.scale = scale, best_.hz = last_hz_, best_.model = std::move(model);
    ++best_.solve_count;
    return absl::OkStatus();
  }

  const client::Client& daemon_;
  const Body& body_;
  const v1::Material& material_;
  const TuneOptions& options_;
  Tuned best_;
  std::string made_;  ///< the best model's name, if this command made it
  double last_hz_ = 0, last_scale_ = 1;
};

/// The size at which a mode has its pitch: f is inversely proportional to it but for the damping.
absl::Status TuneSize(const v1::ModalModelSummary& model, const v1::Material& material,
                      const TuneOptions& options, bool json) {
  double size = 1;
  ASSIGN_OR_RETURN(const double before_hz, FrequencyOf(model, material, options.mode));
  double hz = before_hz;
  for (int round = 0; round < 50 && std::abs(hz / options.to_hz - 1) > 1e-9; ++round) {
    size *= hz / options.to_hz;
    ASSIGN_OR_RETURN(hz, FrequencyOf(model, material, options.mode, size));
  }
  if (json) {
    PrintJson({{"modal_model", model.name()},
               {"mode", uint64_t{options.mode}},
               {"before_hz", before_hz},
               {"frequency_hz", hz},
               {"size", size}});
    return absl::OkStatus();
  }
  absl::PrintF("size        %.6g: mode %d has %.3f Hz in place of %.3f\n", size, options.mode, hz,
               before_hz);
  absl::PrintF("hear it     carillon strike %s --size %.6g --point ... --impulse ...\n",
               EscapedText(options.model), size);
  return absl::OkStatus();
}

void PrintTuned(const Body& body, const Tuned& tuned, double before_hz, const TuneOptions& options,
                bool json) {
  const char axis = "xyz"[body.axis()];
  const double before_m = body.length_m(), after_m = before_m * tuned.scale;
  const double cents = Cents(tuned.hz, options.to_hz);
  if (json) {
    PrintJson({{"modal_model", tuned.model.name()},
               {"mode", uint64_t{options.mode}},
               {"before_hz", before_hz},
               {"frequency_hz", tuned.hz},
               {"cents", cents},
               {"axis", std::string(1, axis)},
               {"scale", tuned.scale},
               {"before_m", before_m},
               {"length_m", after_m},
               {"solves", uint64_t(tuned.solve_count)}});
    return;
  }
  absl::PrintF("along %c     %.6g m in place of %.6g m, x %.6g\n", axis, after_m, before_m,
               tuned.scale);
  absl::PrintF("mode %-6d %.3f Hz (%+.2f cents) in place of %.3f Hz, after %s\n", options.mode,
               tuned.hz, cents, before_hz, Counted(uint64_t(tuned.solve_count), "solve"));
  absl::PrintF("model       %s, label %s\n", tuned.model.name(), EscapedText(tuned.model.label()));
}

}  // namespace

absl::Status TuneModel(const client::Client& daemon, const TuneOptions& options, bool json) {
  ASSIGN_OR_RETURN(const v1::ModalModelSummary model, FindSummary(daemon, options.model));
  ASSIGN_OR_RETURN(const v1::Material given, ToMaterial(options.material));
  if (given.ByteSizeLong() == 0 && !model.has_material()) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   "the model was stored without a material, of which its pitch depends: give "
                   "--material");
  }
  ASSIGN_OR_RETURN(v1::Material material,
                   ResolveMaterial(given.ByteSizeLong() > 0 ? given : model.material()));
  if (options.by == "size") return TuneSize(model, material, options, json);
  ASSIGN_OR_RETURN(const double before_hz, FrequencyOf(model, material, options.mode));
  material.set_poisson_ratio(model.header().settings().poisson_ratio());
  ASSIGN_OR_RETURN(StoredModel surface, Fetch(daemon, model.name()));
  Body body(daemon, model, material, std::move(surface));
  RETURN_IF_ERROR(body.ChooseAxis(options.by));
  // Bending goes with thickness/length^2; for other axes the first probe tells.
  const double slope = options.by == "thickness" ? 1 : options.by == "length" ? -2 : -1;
  ASSIGN_OR_RETURN(const Tuned tuned, Tuner(daemon, body, material, options).Run(slope));
  PrintTuned(body, tuned, before_hz, options, json);
  return absl::OkStatus();
}

}  // namespace carillon::cli
