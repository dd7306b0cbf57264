// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/directed_gains.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace carillon {
namespace {

/// A bank with more terms takes longer periods; this number of terms takes about 5 us.
constexpr size_t kMostTermsPerBlock = 4096;
/// A mode costs about as much as this number of terms, besides its harmonics.
constexpr size_t kTermsPerMode = 4;
/// Gains are computed anew when they may have changed by this share of the largest. Larger steps,
/// each spread over a period, would be audible as a modulation.
constexpr double kLeastChange = 2e-3;
/// Keeps k r above zero for a body whose radius is unknown.
constexpr double kLeastDistanceM = 1e-3;

size_t HarmonicCount(const Directivity& directivity, uint32_t column) {
  return directivity.first[column + 1] - directivity.first[column];
}

size_t CountTerms(const Directivity& directivity, const std::vector<DirectedGains::Mode>& modes) {
  size_t count = 0;
  for (const auto& mode : modes) count += kTermsPerMode + HarmonicCount(directivity, mode.column);
  return count;
}

/// The greatest l of all harmonics of the modes.
size_t OrderOf(const Directivity& directivity, const std::vector<DirectedGains::Mode>& modes) {
  uint32_t last = 0;
  for (const auto& mode : modes) {
    if (HarmonicCount(directivity, mode.column) == 0) continue;
    last = std::max(last, directivity.harmonics[directivity.first[mode.column + 1] - 1]);
  }
  size_t order = 0;
  while ((order + 1) * (order + 1) <= last) ++order;
  return order;
}

std::array<double, 3> Scaled(std::array<double, 3> vector, double factor) {
  for (double& coordinate : vector) coordinate *= factor;
  return vector;
}

}  // namespace

DirectedGains::DirectedGains(const HeardDirectivity& heard, std::vector<Mode> modes,
                             const Size& size)
    : directivity_(heard.directivity),
      center_m_(Scaled(heard.directivity.center_m, heard.size)),
      radius_m_(heard.directivity.radius_m * heard.size),
      near_field_(heard.near_field),
      modes_(std::move(modes)),
      basis_(OrderOf(directivity_, modes_)),
      lane_count_(size.lane_count),
      term_count_(CountTerms(directivity_, modes_)),
      period_(
          std::max((size.period_frame_count + size.block_frame_count - 1) / size.block_frame_count,
                   (term_count_ + kMostTermsPerBlock - 1) / kMostTermsPerBlock)),
      begin_(lane_count_),
      end_(lane_count_),
      target_(lane_count_),
      next_(lane_count_) {}

void DirectedGains::BeginBlock(uint64_t block_number, const Bearing& bearing) noexcept {
  if (block_number == block_number_) return;
  const bool continues = block_number == block_number_ + 1;
  block_number_ = block_number;
  if (!continues) return StartAt(bearing);
  if (block_of_period_ == 0) BeginPeriod(bearing);
  if (computing_) ComputeUntil((block_of_period_ + 1) * term_count_ / period_);
  Glide();
  block_of_period_ = (block_of_period_ + 1) % period_;
}

Bearing DirectedGains::Outside(const Bearing& bearing) const noexcept {
  return {bearing.direction, std::max({bearing.distance_m, radius_m_, kLeastDistanceM})};
}

/// A direction that turns by an angle changes a pattern of order l by at most about l times the
/// angle. In the near field, a change of distance changes the pattern by the order times the
/// relative change.
bool DirectedGains::Differs(const Bearing& bearing) const noexcept {
  double square = 0;
  for (size_t i = 0; i < 3; ++i) {
    square += std::pow(bearing.direction[i] - bearing_.direction[i], 2);
  }
  if (near_field_) square += std::pow(bearing.distance_m / bearing_.distance_m - 1, 2);
  const auto order = static_cast<double>(basis_.order());
  return !known_ || square * order * order > kLeastChange * kLeastChange;
}

/// Prepares the computation of the gains for a bearing.
void DirectedGains::Aim(const Bearing& bearing) noexcept {
  bearing_ = bearing;
  basis_.Evaluate(bearing.direction);
  computed_mode_count_ = computed_term_count_ = 0;
}

void DirectedGains::StartAt(const Bearing& bearing) noexcept {
  const Bearing from = Outside(bearing);
  block_of_period_ = 0;
  if (computing_ || Differs(from)) {
    Aim(from);
    ComputeUntil(term_count_);
    std::swap(target_, next_);
  }
  known_ = true;
  computing_ = gliding_ = moving_ = false;
  std::copy_n(target_.re.data(), lane_count_, end_.re.data());
  std::copy_n(target_.im.data(), lane_count_, end_.im.data());
}

void DirectedGains::BeginPeriod(const Bearing& bearing) noexcept {
  gliding_ = computing_;
  if (computing_) std::swap(target_, next_);
  const Bearing to = Outside(bearing);
  computing_ = Differs(to);
  if (computing_) Aim(to);
}

void DirectedGains::ComputeUntil(size_t term_count) noexcept {
  while (computed_term_count_ < term_count && computed_mode_count_ < modes_.size()) {
    const Mode& mode = modes_[computed_mode_count_++];
    computed_term_count_ += kTermsPerMode + HarmonicCount(directivity_, mode.column);
    SetGain(mode);
  }
}

void DirectedGains::SetGain(const Mode& mode) noexcept {
  const size_t first = directivity_.first[mode.column], end = directivity_.first[mode.column + 1];
  constexpr double kScale = 2 / std::numbers::inv_sqrtpi;
  Number pattern{.re = 1 / kScale};
  if (first < end) {
    pattern = near_field_ ? NearPattern(first, end, mode.wavenumber * bearing_.distance_m)
                          : FarPattern(first, end);
  }
  next_.re[mode.lane] = static_cast<float>(kScale * pattern.re);
  next_.im[mode.lane] = static_cast<float>(-kScale * pattern.im);
  next_.im[mode.companion_lane] = next_.im[mode.lane];
}

DirectedGains::Number DirectedGains::FarPattern(size_t first, size_t end) const noexcept {
  const float* values = basis_.values().data();
  float re = 0, im = 0;
  for (size_t i = first; i < end; ++i) {
    const float value = values[directivity_.harmonics[i]];
    re += directivity_.pattern_re[i] * value;
    im += directivity_.pattern_im[i] * value;
  }
  return {.re = re, .im = im};
}

DirectedGains::Number DirectedGains::NearPattern(size_t first, size_t end,
                                                 double kr) const noexcept {
  Number sum, before{.re = 1}, factor{.re = 1};  // f_(l-1) and f_l
  const double per_kr = 1 / kr;
  for (size_t l = 0, i = first; i < end; ++l) {
    size_t next = i;
    while (next < end && directivity_.harmonics[next] < (l + 1) * (l + 1)) ++next;
    const Number part = FarPattern(i, next);
    i = next;
    sum.re += factor.re * part.re - factor.im * part.im;
    sum.im += factor.re * part.im + factor.im * part.re;
    const double rise = static_cast<double>(2 * l + 1) * per_kr;
    before = std::exchange(
        factor, {.re = before.re - rise * factor.im, .im = before.im + rise * factor.re});
  }
  return sum;
}

void DirectedGains::Glide() noexcept {
  moving_ = gliding_;
  if (!moving_) return;
  std::swap(begin_, end_);
  const float share = 1 / static_cast<float>(period_ - block_of_period_);
  const auto glide = [&](const LaneArray<float>& from, const LaneArray<float>& target,
                         LaneArray<float>& to) {
    for (size_t lane = 0; lane < lane_count_; ++lane) {
      to.data()[lane] = from.data()[lane] + share * (target.data()[lane] - from.data()[lane]);
    }
  };
  glide(begin_.re, target_.re, end_.re);
  glide(begin_.im, target_.im, end_.im);
}

}  // namespace carillon
