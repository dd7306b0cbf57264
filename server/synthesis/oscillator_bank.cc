// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/oscillator_bank.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <complex>
#include <utility>

#include "server/synthesis/bank_kernel.h"
#include "server/synthesis/level.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;

size_t CountLanes(const SoundingModes& sounding) {
  const auto companions = std::ranges::count_if(
      sounding.modes, [](const SoundingMode& mode) { return mode.output_phase_rad != 0; });
  const size_t used = sounding.modes.size() + static_cast<size_t>(companions);
  return (used + kMostLanes - 1) / kMostLanes * kMostLanes;
}

uint32_t FirstColumn(const SoundingModes& sounding) {
  return sounding.modes.empty() ? 0 : sounding.modes.front().column;
}

size_t CountColumns(const SoundingModes& sounding) {
  return sounding.modes.empty() ? 0
                                : sounding.modes.back().column - FirstColumn(sounding) + size_t{1};
}

/// s^2/2; of a mode so damped that it is over before the contact is, where that would explode,
/// -|s|^2/2.
Complex GaussianExponent(const SoundingMode& mode) {
  const Complex s(mode.decay_rate_per_s, mode.damped_rad_per_s);
  const Complex exponent = s * s / 2.0;
  return exponent.real() < 0 ? exponent : -std::norm(s) / 2;
}

/// Fills in lanes one after the other.
class LaneWriter {
 public:
  LaneWriter(LaneArrays& lanes, SustainedForce& force, const SoundingModes& sounding,
             const OscillatorBankSettings& settings)
      : lanes_(lanes),
        force_(force),
        settings_(settings),
        lowest_rad_per_s_(sounding.modes.empty() ? 1 : sounding.modes.front().damped_rad_per_s),
        first_column_(FirstColumn(sounding)),
        gain_(sounding.shape_scale * kSamplesPerVolumeVelocity * settings.gain) {}

  void AddMode(const SoundingMode& mode) { Add(mode, mode.decay_rate_per_s, gain_); }

  void AddCompanion(const SoundingMode& mode) {
    Add(mode, mode.decay_rate_per_s - mode.damped_rad_per_s, -gain_);
  }

 private:
  void Add(const SoundingMode& mode, double decay_rate_per_s, double gain) {
    const Complex log_q =
        Complex(decay_rate_per_s, mode.damped_rad_per_s) / settings_.sample_rate_hz;
    for (size_t k = 0; k < kTileFrames; ++k) SetPower(k, std::exp(log_q * double(k + 1)));
    const Complex block = std::exp(log_q * double(settings_.block_frame_count));
    lanes_.block_re[lane_] = block.real();
    lanes_.block_im[lane_] = block.imag();
    const Complex start =
        std::polar(gain * mode.coupling / mode.damped_rad_per_s, mode.output_phase_rad) *
        Complex(0, -1);
    Set(lanes_.gain_re, lanes_.gain_im, start);
    force_.SetLane(lane_, start, log_q * settings_.sample_rate_hz, lowest_rad_per_s_);
    Set(lanes_.lead_re, lanes_.lead_im, log_q);
    Set(lanes_.tau_re, lanes_.tau_im, GaussianExponent(mode));
    lanes_.column[lane_] = mode.column - first_column_;
    ++lane_;
  }

  void SetPower(size_t k, Complex power) {
    const size_t index = LaneArrays::PowerIndex(lane_, k);
    lanes_.powers[index] = static_cast<float>(power.real());
    lanes_.powers[index + kMostLanes] = static_cast<float>(power.imag());
  }

  void Set(LaneArray<float>& re, LaneArray<float>& im, Complex value) {
    re[lane_] = static_cast<float>(value.real());
    im[lane_] = static_cast<float>(value.imag());
  }

  LaneArrays& lanes_;
  SustainedForce& force_;
  const OscillatorBankSettings& settings_;
  double lowest_rad_per_s_;
  uint32_t first_column_;
  double gain_;
  size_t lane_ = 0;
};

}  // namespace

OscillatorBank::OscillatorBank(const SoundingModes& sounding, ShapeTable shapes,
                               const OscillatorBankSettings& settings)
    : shapes_(std::move(shapes)),
      block_frame_count_(settings.block_frame_count),
      mode_count_(sounding.modes.size()),
      lane_count_(CountLanes(sounding)),
      first_column_(FirstColumn(sounding)),
      column_count_(CountColumns(sounding)),
      lanes_(lane_count_, column_count_),
      force_(lane_count_, column_count_, settings.sample_rate_hz, settings.noise_seed) {
  assert(block_frame_count_ > 0 && block_frame_count_ <= kMostBlockFrames);
  assert(first_column_ + column_count_ <= shapes_.mode_count);
  LaneWriter writer(lanes_, force_, sounding, settings);
  for (const SoundingMode& mode : sounding.modes) writer.AddMode(mode);
  for (const SoundingMode& mode : sounding.modes) {
    if (mode.output_phase_rad != 0) writer.AddCompanion(mode);
  }
}

std::optional<bank_kernel::Projection> OscillatorBank::Project(
    const Excitation& excitation) const noexcept {
  bank_kernel::Projection projection{.column_count = column_count_, .tau_s = excitation.tau_s};
  for (size_t i = 0; i < 3; ++i) {
    const size_t vertex = excitation.vertices[i];
    if (vertex >= shapes_.vertex_count) return std::nullopt;
    for (size_t axis = 0; axis < 3; ++axis) {
      projection.rows[3 * i + axis] =
          shapes_.values.get() + (3 * vertex + axis) * shapes_.mode_count + first_column_;
      projection.factors[3 * i + axis] =
          excitation.weights[i] * excitation.impulse_newton_seconds[axis];
    }
  }
  return projection;
}

bool OscillatorBank::Strike(const Excitation& excitation, size_t offset, float lead_frames,
                            LaneMix& mix) noexcept {
  std::optional<bank_kernel::Projection> projection = Project(excitation);
  if (!projection) return false;
  projection->lead_frames = lead_frames;
  const bool was_newborn = newborn_;
  BringNewbornTo(offset, mix);
  const bool finite = bank_kernel::Excite(*projection, lanes_, lane_count_);
  newborn_ = finite || was_newborn || force_.driving();
  return finite;
}

bool OscillatorBank::Gather(const Excitation& force) noexcept {
  const std::optional<bank_kernel::Projection> projection = Project(force);
  if (projection) force_.Gather(*projection);
  return projection.has_value();
}

bool OscillatorBank::Tie(const ForceKnot& knot, size_t offset, LaneMix& mix) noexcept {
  BringNewbornTo(offset, mix);
  newborn_ = true;
  return force_.Tie(knot, lanes_);
}

void OscillatorBank::BringNewbornTo(size_t offset, LaneMix& mix) noexcept {
  if (force_.driving() && !newborn_) {
    newborn_ = true;
    newborn_offset_ = 0;
  }
  if (newborn_) RenderNewborn(offset, mix);
  newborn_offset_ = offset;
}

void OscillatorBank::RenderNewborn(size_t end, LaneMix& mix) noexcept {
  assert(end >= newborn_offset_);
  const size_t frame_count = end - newborn_offset_;
  float* frames = mix.lanes() + newborn_offset_ * kMostLanes;
  if (force_.driving()) {
    force_.RenderNewborn(frame_count, lanes_, frames);
  } else {
    bank_kernel::RingNewborn(lanes_, lane_count_, frame_count, frames);
  }
  newborn_offset_ = end;
}

bool OscillatorBank::RenderAdd(LaneMix& mix) noexcept {
  if (silent()) return true;
  bank_kernel::Ring(lanes_, awake_lane_count_, block_frame_count_, mix.lanes());
  if (newborn_ || force_.driving()) BringNewbornTo(block_frame_count_, mix);
  const size_t lane_count = newborn_ ? lane_count_ : awake_lane_count_;
  const auto [awake_lane_count, finite] = bank_kernel::Advance(lanes_, lane_count, newborn_);
  newborn_ = false;
  awake_lane_count_ = finite ? awake_lane_count : 0;
  if (finite) return true;
  lanes_.Silence(0, lane_count_);
  force_.Silence();
  return false;
}

size_t OscillatorBank::active_mode_count() const noexcept {
  return std::min(newborn_ ? lane_count_ : awake_lane_count_, mode_count_);
}

std::string_view SimdTarget() { return bank_kernel::Target(); }

}  // namespace carillon
