// SPDX-License-Identifier: Apache-2.0
#include "server/excitation/yielding_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLeastShare = 0.001;
/// Modes that are nearer to each other than this are the same to a contact of some milliseconds.
constexpr double kBandHz = 100;
constexpr double kLongestS = 6e-3;
constexpr double kLongestStepS = 6e-6;  // an eighth of a period at 20 kHz
constexpr size_t kMostSteps = 8192;

/// Returns the squared factor of a raised cosine of duration T for a mode (docs/physics.md, 3).
double CosineFactorSquared(const StruckMode& mode, double duration_s) {
  const std::complex<double> x =
      0.5 * duration_s * std::complex(mode.decay_rate_per_s, mode.damped_rad_per_s);
  const std::complex<double> rest = 1.0 + x * x / (kPi * kPi);
  if (std::abs(rest) < 1e-6) return 0.25;
  return std::norm(std::sinh(x) / x / rest);
}

/// Returns a bound on the share of the striker's energy J^2/(8 m) that the modes get from a raised
/// cosine, of which the squared factor is below (3/x)^6.
double ShareBound(std::span<const StruckMode> modes, double reduced_mass_kg, double duration_s) {
  double sum = 0;
  for (const StruckMode& mode : modes) {
    const double y = 3 / std::max(0.5 * duration_s * mode.damped_rad_per_s, 3.0);
    sum += mode.shape_squared_per_kg * (y * y * y) * (y * y * y);
  }
  return 4 * reduced_mass_kg * sum;
}

size_t BandOf(const StruckMode& mode) {
  return static_cast<size_t>(mode.damped_rad_per_s / (2 * kPi * kBandHz));
}

/// The modes of a body, in bands of kBandHz, as oscillators that a force drives.
class Oscillators {
 public:
  explicit Oscillators(std::span<const StruckMode> modes) {
    size_t last = 0;
    for (const StruckMode& mode : modes) last = std::max(last, BandOf(mode));
    std::vector<double> weighted(last + 1), weight(last + 1);
    for (const StruckMode& mode : modes) {
      weight[BandOf(mode)] += mode.shape_squared_per_kg;
      weighted[BandOf(mode)] += mode.shape_squared_per_kg * mode.damped_rad_per_s;
    }
    oscillator_of_band_.resize(last + 1);
    for (size_t band = 0; band <= last; ++band) {
      if (!(weight[band] > 0)) continue;
      oscillator_of_band_[band] = count_++;
      weights_.push_back(static_cast<float>(weight[band]));
      rad_per_s_.push_back(static_cast<float>(weighted[band] / weight[band]));
      sum_of_weights_ += weight[band];
    }
    // Padding has no weight, and so stays at rest.
    const size_t padded = (count_ + kLanes - 1) / kLanes * kLanes;
    weights_.resize(padded);
    rad_per_s_.resize(padded, 1);
    for (auto* array : {&cosine_, &sine_up_, &sine_down_, &displacement_, &velocity_}) {
      array->resize(padded);
    }
  }

  void SetStep(double step_s) {
    for (size_t i = 0; i < weights_.size(); ++i) {
      const double omega = rad_per_s_[i];
      cosine_[i] = static_cast<float>(std::cos(omega * step_s));
      sine_up_[i] = static_cast<float>(std::sin(omega * step_s) / omega);
      sine_down_[i] = static_cast<float>(-std::sin(omega * step_s) * omega);
    }
  }

  /// Applies an impulse, N s, and then advances by a step. Returns the displacement, m.
  double Advance(double impulse_newton_seconds) {
    const auto kick = static_cast<float>(impulse_newton_seconds);
    std::array<float, kLanes> sums{};
    for (size_t first = 0; first < weights_.size(); first += kLanes) {
      for (size_t lane = 0; lane < kLanes; ++lane) {
        const size_t i = first + lane;
        const float u = displacement_[i], v = velocity_[i] + weights_[i] * kick;
        displacement_[i] = cosine_[i] * u + sine_up_[i] * v;
        velocity_[i] = sine_down_[i] * u + cosine_[i] * v;
        sums[lane] += displacement_[i];
      }
    }
    double sum = 0;
    for (const float lane : sums) sum += double{lane};
    return sum;
  }

  /// Returns a displacement that the oscillators, with random phases, hardly ever exceed.
  double Reach() const {
    double sum = 0;
    for (size_t i = 0; i < count_; ++i) {
      const double amplitude = std::hypot(displacement_[i], velocity_[i] / rad_per_s_[i]);
      sum += amplitude * amplitude;
    }
    return 1.5 * std::sqrt(sum);
  }

  /// Returns the part of a mode in the energy, J.
  double EnergyOf(const StruckMode& mode) const {
    const size_t i = oscillator_of_band_[BandOf(mode)];
    const double speed = std::hypot(velocity_[i], displacement_[i] * rad_per_s_[i]);
    const double weight = weights_[i];
    return weight > 0 ? 0.5 * speed * speed / weight * (mode.shape_squared_per_kg / weight) : 0;
  }

  double sum_of_weights() const { return sum_of_weights_; }

 private:
  static constexpr size_t kLanes = 8;

  size_t count_ = 0;
  double sum_of_weights_ = 0;
  std::vector<size_t> oscillator_of_band_;
  std::vector<float> weights_, rad_per_s_, cosine_, sine_up_, sine_down_, displacement_, velocity_;
};

/// Lets a striker of mass m meet the oscillators at speed v, with Hertz's spring of duration T.
void Collide(double mass_kg, double speed_m_per_s, double duration_s, Oscillators& oscillators) {
  const double stiffness = std::pow(3.218 / duration_s, 2.5) * mass_kg / std::sqrt(speed_m_per_s);
  const double deepest_m =
      std::pow(1.25 * mass_kg * speed_m_per_s * speed_m_per_s / stiffness, 0.4);
  const double contact_rad_per_s = std::sqrt(1.5 * stiffness * std::sqrt(deepest_m) *
                                             (1 / mass_kg + oscillators.sum_of_weights()));
  const double step_s = std::min({0.6 / contact_rad_per_s, duration_s / 16, kLongestStepS});
  oscillators.SetStep(step_s);
  const size_t step_count = std::min(kMostSteps, static_cast<size_t>(kLongestS / step_s) + 1);
  double striker_m = 0, speed = speed_m_per_s, surface_m = 0;
  for (size_t step = 0; step < step_count; ++step) {
    const double depth_m = striker_m - surface_m;
    const double force = depth_m > 0 ? stiffness * depth_m * std::sqrt(depth_m) : 0;
    constexpr size_t kLook = 32;
    if (step % kLook == kLook - 1 && force == 0 && striker_m < -oscillators.Reach()) return;
    speed -= force / mass_kg * step_s;
    striker_m += speed * step_s;
    surface_m = oscillators.Advance(force * step_s);
  }
}

}  // namespace

OctaveGains YieldingGains(std::span<const StruckMode> modes, const Collision& collision,
                          double impulse_newton_seconds, double duration_s) {
  OctaveGains gains;
  const double mass_kg = collision.reduced_mass_kg, impulse = impulse_newton_seconds;
  if (modes.empty() || !(ShareBound(modes, mass_kg, duration_s) > kLeastShare)) return gains;
  const double elastic_speed = impulse / (2 * mass_kg);
  const double speed =
      collision.stated_speed_m_per_s > 0 ? collision.stated_speed_m_per_s : elastic_speed;
  Oscillators oscillators(modes);
  Collide(mass_kg, speed, duration_s, oscillators);
  const double scale = elastic_speed / speed;  // the blow keeps the stated impulse
  std::array<double, OctaveGains::kCount> solved{}, by_pulse{};
  for (const StruckMode& mode : modes) {
    const size_t octave = OctaveGains::OctaveOf(mode.damped_rad_per_s / (2 * kPi));
    solved[octave] += scale * scale * oscillators.EnergyOf(mode);
    by_pulse[octave] +=
        0.5 * impulse * impulse * mode.shape_squared_per_kg * CosineFactorSquared(mode, duration_s);
  }
  for (size_t octave = 0; octave < OctaveGains::kCount; ++octave) {
    if (!(solved[octave] > 0) || !(by_pulse[octave] > 0)) continue;
    gains.SetDb(octave, 10 * std::log10(solved[octave] / by_pulse[octave]));
  }
  return gains;
}

}  // namespace carillon
