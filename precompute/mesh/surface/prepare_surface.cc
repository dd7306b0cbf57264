// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/surface/prepare_surface.h"

#include <numeric>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "precompute/mesh/point_math.h"
#include "precompute/mesh/surface/check_surface.h"
#include "precompute/mesh/surface/coarsen_surface.h"
#include "precompute/mesh/surface/make_wall.h"
#include "precompute/mesh/surface/nearest_triangle.h"
#include "precompute/mesh/surface/repair_locally.h"
#include "precompute/mesh/surface/repair_soup.h"
#include "precompute/mesh/surface/wrap_surface.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

using Warnings = std::vector<std::string>;

bool Is(const absl::Status& status, absl::string_view reason) {
  return ToErrorInfo(status).reason() == reason;
}

/// Errors that repair cannot correct: no surface, coordinates that are not finite, or several
/// bodies.
bool BeyondRepair(const absl::Status& status) {
  for (const char* reason : {"MESH_EMPTY", "MESH_TOO_LARGE", "MESH_INDEX_OUT_OF_RANGE",
                             "MESH_NOT_FINITE", "MESH_SEVERAL_PIECES"}) {
    if (Is(status, reason)) return true;
  }
  return false;
}

void AddTo(Warnings& warnings, const Warnings& more) {
  warnings.insert(warnings.end(), more.begin(), more.end());
}

std::vector<int32_t> NearestGiven(const SurfaceMesh& surface, const SurfaceMesh& given) {
  const NearestTriangle index(given);
  std::vector<int32_t> nearest;
  for (size_t t = 0; t < surface.triangles.size(); ++t) {
    nearest.push_back(index.Find(MiddleOf(CornersOf(surface, t))).triangle);
  }
  return nearest;
}

/// Repairs the faults that CheckSurface finds, one kind of fault at a time, in the places where
/// they are. Returns the result of CheckSurface for the repaired surface.
absl::StatusOr<Warnings> RepairWithoutWrapping(RepairedSurface& repaired) {
  absl::StatusOr<Warnings> sound = CheckSurface(repaired.surface);
  const auto take = [&](std::optional<RepairedSurface> better) {
    if (!better) return;
    absl::StatusOr<Warnings> after = CheckSurface(better->surface);
    if (ToErrorInfo(after.status()).reason() == ToErrorInfo(sound.status()).reason()) return;
    repaired.surface = std::move(better->surface);
    AddTo(repaired.remarks, better->remarks);
    sound = std::move(after);
  };
  if (Is(sound.status(), "MESH_NOT_CLOSED")) take(FillHoles(repaired.surface));
  if (Is(sound.status(), "MESH_SELF_INTERSECTING") ||
      Is(sound.status(), "MESH_DEGENERATE_TRIANGLE")) {
    take(Unfold(repaired.surface));
  }
  if (Is(sound.status(), "MESH_SELF_INTERSECTING") ||
      Is(sound.status(), "MESH_DEGENERATE_TRIANGLE")) {
    take(Untangle(repaired.surface));
  }
  return sound;
}

/// Part of the diagonal above which the width of a hole, as WidestHole measures it, is too great
/// for a wrap: twice the width that the wrap closes, because a slit has twice its width.
constexpr double kWideHolePart = 2 * kWrappedHolePart;

/// A surface with an opposite side within this many thicknesses is a wall already, and must not get
/// another one on each side.
constexpr double kOppositeWalls = 2.5;
/// Part of the diagonal that a refusal advises as the thickness of a wall.
constexpr double kAdvisedWallPart = 0.02;

bool IsWallAlready(const SurfaceMesh& surface) {
  return HasTwoSides(surface, kOppositeWalls * kAdvisedWallPart * Diagonal(surface.vertices));
}

/// The last words of a refusal of a hole.
const char* ClosingAdvice(const SurfaceMesh& surface) {
  return IsWallAlready(surface)
             ? "close the hole (the surface has both sides of its wall already, and needs no "
               "--wall)"
             : "close the hole, or, if the surface is a thin wall, give it a thickness (--wall)";
}

absl::Status WideHole(double width_m, const SurfaceMesh& surface) {
  const double diagonal_m = Diagonal(surface.vertices);
  return Refusal(
      absl::StatusCode::kInvalidArgument, "MESH_NOT_CLOSED",
      absl::StrFormat(
          "the surface has a hole about %.3g m wide, which repair does not close: it fills holes "
          "in flat faces, other holes whose rim is shorter than %.3g m if all of them have at most "
          "a twentieth of the area, and by wrapping those narrower than %.3g m; %s",
          width_m, diagonal_m, kWrappedHolePart * diagonal_m, ClosingAdvice(surface)));
}

/// Returns a refusal if the surface, repaired but for wrapping, has a hole that a wrap would enter.
absl::Status CheckHoles(const absl::Status& sound, const SurfaceMesh& surface) {
  if (!Is(sound, "MESH_NOT_CLOSED")) return absl::OkStatus();
  const double width_m = WidestHole(surface);
  if (width_m <= kWideHolePart * Diagonal(surface.vertices)) return absl::OkStatus();
  return WideHole(width_m, surface);
}

/// Repairs a surface without changing its shape. If corners that lie close together leave it open,
/// they are joined, provided that this makes it sound.
RepairedSurface RepairInPlace(const SurfaceMesh& given) {
  RepairedSurface repaired = RepairSoup(given);
  if (CheckSurface(repaired.surface).ok()) return repaired;
  RepairedSurface joined = RepairSoup(given, JoinDistance(given));
  return CheckSurface(joined.surface).ok() ? std::move(joined) : std::move(repaired);
}

/// Adds figures to the refusal of an open surface, from which remedies follow: whether repair can
/// close it, and whether it is a solid body that lacks parts of flat faces rather than a thin wall.
absl::Status WithRemediesOfHoles(absl::Status refusal, const SurfaceMesh& given) {
  if (!Is(refusal, "MESH_NOT_CLOSED")) return refusal;
  RepairedSurface repaired = RepairInPlace(given);
  const auto flat = CloseFlatFaces(repaired.surface);
  const bool lacks_flat_parts = flat && CheckSurface(flat->surface).ok();
  const bool repair_helps =
      lacks_flat_parts ||
      CheckHoles(RepairWithoutWrapping(repaired).status(), repaired.surface).ok();
  AddFigure(refusal, "repair_helps", repair_helps ? "1" : "0");
  AddFigure(refusal, "wall_helps", lacks_flat_parts || IsWallAlready(given) ? "0" : "1");
  return refusal;
}

/// Repairs the surface until it passes the checks, and describes the repairs in `warnings`. Sets
/// `origin` to that of the triangles.
absl::StatusOr<SurfaceMesh> Repair(const SurfaceMesh& given, Warnings& warnings,
                                   TriangleOrigin& origin) {
  RepairedSurface repaired = RepairInPlace(given);
  const absl::StatusOr<Warnings> sound = RepairWithoutWrapping(repaired);
  if (sound.ok()) {
    AddTo(warnings, repaired.remarks);
    AddTo(warnings, *sound);
    return std::move(repaired.surface);
  }
  if (BeyondRepair(sound.status())) return sound.status();
  RETURN_IF_ERROR(CheckHoles(sound.status(), repaired.surface));
  ASSIGN_OR_RETURN(RepairedSurface wrapped, WrapSurface(repaired.surface));
  AddTo(warnings, repaired.remarks);
  AddTo(warnings, wrapped.remarks);
  origin = TriangleOrigin::kWrap;
  return std::move(wrapped.surface);
}

/// Returns the refusal of a failed repair, which also says what was to be repaired.
absl::Status WithFirstFault(const absl::Status& failed, const absl::Status& as_given) {
  if (failed.message() == as_given.message()) return failed;
  v1::ErrorInfo error = ToErrorInfo(failed);
  error.set_message(absl::StrCat(
      error.message(), ". As given, the surface has another fault: ", as_given.message()));
  (*error.mutable_metadata())["given_reason"] = ToErrorInfo(as_given).reason();
  return FromErrorInfo(failed.code(), error);
}

absl::StatusOr<RepairedSurface> WithWall(const SurfaceMesh& surface, const absl::Status& sound,
                                         double wall_m) {
  if (sound.ok()) return HollowOut(surface, wall_m);
  if (HasTwoSides(surface, kOppositeWalls * wall_m)) {
    return WithRemediesOfHoles(
        Refusal(absl::StatusCode::kInvalidArgument, "MESH_NOT_CLOSED",
                absl::StrFormat("the surface is open, and has both sides of its wall already: most "
                                "of it has an opposite side within %.3g m. A wall of %g m on each "
                                "side would make it too heavy: close its holes, without --wall",
                                kOppositeWalls * wall_m, wall_m)),
        surface);
  }
  absl::StatusOr<RepairedSurface> thickened = Thicken(surface, wall_m);
  if (thickened.ok()) return thickened;
  absl::Status refusal = thickened.status();
  AddFigure(refusal, "open", "1");  // so that no remedy leaves out the wall
  return refusal;
}

}  // namespace

absl::StatusOr<PreparedSurface> PrepareSurface(const SurfaceMesh& given,
                                               const PreparationSettings& settings) {
  PreparedSurface prepared{.surface = given, .given_triangle = {}, .warnings = {}};
  const absl::StatusOr<Warnings> as_given = CheckSurface(given);
  absl::Status sound = as_given.status();
  if (as_given.ok()) prepared.warnings = *as_given;
  if (!sound.ok() && BeyondRepair(sound)) return sound;
  TriangleOrigin origin = TriangleOrigin::kGiven;
  // An open sheet that is to get a wall needs no repair.
  if (!sound.ok() && settings.repair && !(settings.wall_m > 0 && Is(sound, "MESH_NOT_CLOSED"))) {
    absl::StatusOr<SurfaceMesh> repaired = Repair(given, prepared.warnings, origin);
    sound = repaired.ok() ? absl::OkStatus() : WithFirstFault(repaired.status(), sound);
    if (repaired.ok()) {
      prepared.surface = *std::move(repaired);
      prepared.warnings.emplace_back(
          "the stated errors are those of the repaired body; the difference between its shape and "
          "that of the real body adds to them");
    }
  }
  const bool thickens = settings.wall_m > 0 && Is(sound, "MESH_NOT_CLOSED");
  if (!sound.ok() && !thickens) {
    if (!settings.repair) return WithRemediesOfHoles(sound, given);
    if (IsWallAlready(given)) AddFigure(sound, "wall_helps", "0");
    return sound;
  }
  if (settings.wall_m > 0) {
    ASSIGN_OR_RETURN(RepairedSurface walled, WithWall(prepared.surface, sound, settings.wall_m));
    prepared.surface = std::move(walled.surface);
    AddTo(prepared.warnings, walled.remarks);
  }
  bool changed = settings.wall_m > 0 || !as_given.ok();
  if (settings.coarsen) {
    if (auto coarse = CoarsenSurface(prepared.surface, settings.most_triangles, origin)) {
      prepared.surface = std::move(coarse->surface);
      prepared.warnings.push_back(std::move(coarse->remark));
      prepared.frequency_error = coarse->frequency_error;
      changed = true;
    }
  }
  prepared.given_triangle.resize(given.triangles.size());
  std::iota(prepared.given_triangle.begin(), prepared.given_triangle.end(), 0);
  if (changed) prepared.given_triangle = NearestGiven(prepared.surface, given);
  return prepared;
}

absl::StatusOr<PreparedSurface> PrepareParts(const SurfaceMesh& given,
                                             const std::vector<int32_t>& region_of_triangle,
                                             const std::vector<std::string>& names) {
  ASSIGN_OR_RETURN(JoinedParts joined, JoinParts(given, region_of_triangle, names));
  PreparedSurface prepared{.surface = std::move(joined.outside),
                           .given_triangle = {},
                           .warnings = {},
                           .walls = std::move(joined.walls),
                           .parts = std::move(joined.parts)};
  prepared.given_triangle = NearestGiven(prepared.surface, given);
  return prepared;
}

}  // namespace carillon::precompute
