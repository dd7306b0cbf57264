// SPDX-License-Identifier: Apache-2.0
#include "server/scene/diagnostics.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/shortest_decimal.h"

namespace carillon {
namespace {

/// Change of an object's speed, m/s, beyond which an impulse is probably a mistake.
constexpr double kFastSpeed = 100;
/// Part of an object's extent beyond which a point is far from the surface.
constexpr double kDistantShare = 0.05;
/// Steps that stand are probably a mistake if there are this many, and this part of all.
constexpr uint64_t kManyStanding = 10, kStandingPart = 5;

}  // namespace

void Diagnostics::BeginStep(double time_s) {
  if (time_s_) intervals_.Add(time_s - *time_s_);
  stands_ = time_s_ == time_s;
  has_force_ = false;
  time_s_ = time_s;
  ++step_count_;
}

void Diagnostics::NoteForce() {
  if (std::exchange(has_force_, true)) return;
  ++force_step_count_;
  findings_.standing_step_count += stands_ ? 1 : 0;
}

bool Diagnostics::NoteZero(const ObjectContact& contact) {
  const auto& [x, y, z] = contact.impulse.impulse_newton_seconds;
  const bool zero = x == 0 && y == 0 && z == 0;
  if (zero) ++findings_.zero_impulse_count;
  return zero;
}

absl::Status Diagnostics::Examine(std::span<const BodyImpulse> impulses, const Vector3& vector,
                                  double seconds) {
  const auto& [x, y, z] = vector;
  // No less than the length, and far quicker.
  const double bound = (std::abs(x) + std::abs(y) + std::abs(z)) * seconds;
  for (const BodyImpulse& one : impulses) {
    findings_.largest_distance_m = std::max(findings_.largest_distance_m, one.distance_m);
    if (one.distance_m > kDistantShare * one.extent_m) ++findings_.distant_point_count;
    const double noted_speed = std::min(kFastSpeed, findings_.largest_speed_change_m_per_s);
    if (bound <= noted_speed * one.mass_kg) continue;
    const double impulse = std::hypot(x, y, z) * seconds;
    if (impulse <= one.largest_newton_seconds) {
      NoteSpeedChange(impulse / one.mass_kg);
      continue;
    }
    ++findings_.too_large_impulse_count;
    return Refusal(absl::StatusCode::kInvalidArgument, "IMPULSE_TOO_LARGE",
                   absl::StrCat("an impulse of ", impulse, " N s on object ", one.handle,
                                ": it may be at most ", one.largest_newton_seconds,
                                ", ten times the object's mass times the speed of sound in its "
                                "material; send newton seconds, and check the object's size"));
  }
  return absl::OkStatus();
}

void Diagnostics::NoteSpeedChange(double speed_m_per_s) {
  findings_.largest_speed_change_m_per_s =
      std::max(findings_.largest_speed_change_m_per_s, speed_m_per_s);
  if (speed_m_per_s > kFastSpeed) ++findings_.fast_impulse_count;
}

void Diagnostics::Reject(uint64_t count, absl::Status reason) {
  if (rejected_count_ == 0) first_rejected_time_s_ = time_s_.value_or(0);
  rejected_count_ += count;
  if (rejections_ != nullptr) rejections_->Add(count, reason);
  last_rejection_ = std::move(reason);
  last_rejected_time_s_ = time_s_.value_or(0);
}

absl::Status Diagnostics::last_rejection() const {
  if (last_rejection_.ok() || step_count_ <= 1) return last_rejection_;
  absl::Status newest = AtTime(last_rejection_, last_rejected_time_s_);
  if (first_rejected_time_s_ == last_rejected_time_s_) return newest;
  v1::ErrorInfo error = ToErrorInfo(newest);
  const std::string first = ShortestDecimal(first_rejected_time_s_);
  error.set_message(absl::StrCat("the first of ", rejected_count_, " rejections was at ", first,
                                 " s, and the newest ", error.message()));
  (*error.mutable_metadata())["first_time_s"] = first;
  return FromErrorInfo(newest.code(), error);
}

IntakeFindings Diagnostics::findings(const BlowCounts& engine,
                                     const EngineMistakes& mistakes) const {
  IntakeFindings findings = findings_;
  if (findings.standing_step_count < kManyStanding ||
      kStandingPart * findings.standing_step_count < force_step_count_) {
    findings.standing_step_count = 0;
  }
  findings.engine = engine;
  findings.mistakes = mistakes;
  findings.regular_gap_s = intervals_.RegularGapS();
  return findings;
}

}  // namespace carillon
