// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/acceleration_noise.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <utility>

#include "server/synthesis/bank/level.h"
#include "server/synthesis/ringing/node_mix.h"

namespace carillon {
namespace {

using Complex = std::complex<double>;
using Vector = std::array<double, 3>;

constexpr double kPi = std::numbers::pi;
constexpr double kShortestPulseFrames = 2, kLongestPulseS = 0.15;
/// A state below -160 dB of full scale is silent.
constexpr double kSilence = 1e-8;
/// Index of the dipole's and of the quadrupole's first harmonic, and the end of the latter's.
constexpr std::array<size_t, 3> kFirstHarmonic = {1, 4, 9};

/// The roots of s^3 + 4 s^2 + 9 s + 9: the real one, and one of the pair.
constexpr double kRealRoot = -1.783243428049;
Complex PairRoot() {
  const double re = -(4 + kRealRoot) / 2;
  return {re, std::sqrt(-9 / kRealRoot - re * re)};
}

Vector Cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The inverse of a symmetric tensor (xx, yy, zz, xy, yz, zx); zeros if it has none.
std::array<double, 9> Inverse(const std::array<double, 6>& t) {
  const std::array<Vector, 3> rows = {Vector{t[0], t[3], t[5]}, Vector{t[3], t[1], t[4]},
                                      Vector{t[5], t[4], t[2]}};
  const std::array<Vector, 3> columns = {Cross(rows[1], rows[2]), Cross(rows[2], rows[0]),
                                         Cross(rows[0], rows[1])};
  const double determinant =
      rows[0][0] * columns[0][0] + rows[0][1] * columns[0][1] + rows[0][2] * columns[0][2];
  std::array<double, 9> inverse{};
  if (!(determinant > 0)) return inverse;
  for (size_t i = 0; i < 9; ++i) inverse[i] = columns[i % 3][i / 3] / determinant;
  return inverse;
}

RigidRadiation Scaled(RigidRadiation body, double size, double density) {
  body.volume_m3 *= std::pow(size, 3);
  for (double& coordinate : body.center_of_mass_m) coordinate *= size;
  for (double& moment : body.inertia_kg_m2) moment *= density * std::pow(size, 5);
  for (size_t motion = 0; motion < body.motions.size(); ++motion) {
    body.motions[motion].radius_m *= size;
    if (motion < 3) continue;
    for (double& strength : body.motions[motion].strengths) strength *= size;
  }
  return body;
}

double Square(double value) { return value * value; }

}  // namespace

AccelerationNoise::AccelerationNoise(const MovedBody& moved, double sample_rate_hz,
                                     double samples_per_pascal)
    : moved_(moved),
      rate_(sample_rate_hz),
      scale_(samples_per_pascal * moved.air_density_kg_per_m3) {
  moved_.body = Scaled(moved.body, moved.size, moved.density_kg_per_m3);
  inverse_ = Inverse(moved_.body.inertia_kg_m2);
  for (size_t motion = 0; motion < kMotions; ++motion) {
    const double radius_m = moved_.body.motions[motion].radius_m;
    if (!(radius_m > 0)) continue;  // this motion moves no air
    for (const size_t source : {2 * motion, 2 * motion + 1}) {
      AddPoles(source, moved.sound_speed_m_per_s / radius_m);
    }
  }
}

void AccelerationNoise::AddPoles(size_t source, double speed_per_radius) {
  const auto add = [&](Complex root, Complex residue) {
    const Complex step = std::exp(root * speed_per_radius / rate_);
    const Complex p = root * speed_per_radius, r = residue * speed_per_radius;
    poles_[pole_count_++] = {.source = source,
                             .p = {p.real(), p.imag()},
                             .residue = {r.real(), r.imag()},
                             .step = {step.real(), step.imag()}};
  };
  if (source % 2 == 0) return add({-1, 1}, {1, 1});
  const auto residue = [](Complex s) { return s * s / (3.0 * s * s + 8.0 * s + 9.0); };
  add(PairRoot(), 2.0 * residue(PairRoot()));
  add(kRealRoot, residue(kRealRoot));
}

/// The six accelerations at w = 1.
AccelerationNoise::Accelerations AccelerationNoise::AccelerationsBy(
    const SurfaceImpulse& impulse) const noexcept {
  Vector arm{}, newton_seconds{};
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < 3; ++i) {
      const std::array<float, 3>& vertex = moved_.vertices[impulse.at.vertices[i]];
      arm[axis] += moved_.size * impulse.at.weights[i] * vertex[axis];
    }
    arm[axis] -= moved_.body.center_of_mass_m[axis];
    newton_seconds[axis] = impulse.impulse_newton_seconds[axis];
  }
  const Vector moment = Cross(arm, newton_seconds);
  Accelerations by{};
  for (size_t axis = 0; axis < 3; ++axis) {
    by[axis] = newton_seconds[axis] / (moved_.density_kg_per_m3 * moved_.body.volume_m3);
    for (size_t i = 0; i < 3; ++i) by[3 + axis] += inverse_[3 * axis + i] * moment[i];
  }
  return by;
}

double AccelerationNoise::PulseFrames(Pulse pulse, double sample_rate_hz) noexcept {
  const double told_s = Pulse::OfVariance(pulse.variance_s2(), Pulse()).duration_s();
  return std::min(std::max(kShortestPulseFrames, told_s * sample_rate_hz),
                  kLongestPulseS * sample_rate_hz);
}

void AccelerationNoise::Begin(const SurfaceImpulse& impulse, size_t offset, float lead_frames,
                              const Bearing* bearing) noexcept {
  const Accelerations by = AccelerationsBy(impulse);
  const Weights weights = bearing != nullptr ? WeightsTowards(*bearing, by) : MeanWeights(by);
  double magnitude = 0;
  for (const double weight : weights) magnitude += std::abs(weight);
  if (!(magnitude > 0) || !std::isfinite(magnitude)) return;
  double duration_s = PulseFrames(impulse.pulse) / rate_;
  ActivePulse* joined = nullptr;
  if (pulses_.size() == kMostPulses) {
    joined = MostLike(offset, duration_s);
    if (joined == nullptr) return;
    offset = joined->begin;
    lead_frames = static_cast<float>(joined->lead_s * rate_);
    duration_s = joined->duration_s;
  }
  const double end = static_cast<double>(offset) - lead_frames + duration_s * rate_;
  const double rad_per_s = 2 * kPi / duration_s;
  ActivePulse active{.begin = offset,
                     .end = static_cast<size_t>(std::ceil(end)),
                     .lead_s = lead_frames / rate_,
                     .end_lead_s = (std::ceil(end) - end) / rate_,
                     .duration_s = duration_s,
                     .weights = weights};
  Number sum;
  for (size_t source = 0; source < kSources; ++source) {
    if (weights[source] == 0) continue;
    const Number response = ResponseAt(source, rad_per_s);
    sum.re -= weights[source] * response.re / duration_s;
    sum.im -= weights[source] * response.im / duration_s;
  }
  const double lead = rad_per_s * lead_frames / rate_, step = rad_per_s / rate_;
  active.phasor = {.re = sum.re * std::cos(lead) - sum.im * std::sin(lead),
                   .im = sum.re * std::sin(lead) + sum.im * std::cos(lead)};
  active.turn = {.re = std::cos(step), .im = std::sin(step)};
  if (joined == nullptr) return pulses_.push_back(active);
  for (size_t source = 0; source < kSources; ++source) joined->weights[source] += weights[source];
  joined->phasor.re += active.phasor.re;
  joined->phasor.im += active.phasor.im;
}

/// Returns the pulse that is about to start and differs least from one of this begin and duration,
/// or null if all have started.
AccelerationNoise::ActivePulse* AccelerationNoise::MostLike(size_t begin,
                                                            double duration_s) noexcept {
  ActivePulse* nearest = nullptr;
  double least = 0;
  for (ActivePulse& pulse : pulses_) {
    if (pulse.begun) continue;
    const double differs = std::abs(static_cast<double>(pulse.begin) - static_cast<double>(begin)) +
                           std::abs(pulse.duration_s - duration_s) * rate_;
    if (nearest != nullptr && differs >= least) continue;
    nearest = &pulse;
    least = differs;
  }
  return nearest;
}

AccelerationNoise::Weights AccelerationNoise::WeightsTowards(const Bearing& bearing,
                                                             const Accelerations& by) noexcept {
  basis_.Evaluate(bearing.direction);
  Weights weights{};
  for (size_t source = 0; source < kSources; ++source) {
    const RigidRadiation::Motion& motion = moved_.body.motions[source / 2];
    double pattern = 0;
    for (size_t i = kFirstHarmonic[source % 2]; i < kFirstHarmonic[source % 2 + 1]; ++i) {
      pattern += motion.strengths[i] * basis_.values()[i];
    }
    weights[source] = scale_ * by[source / 2] * Square(motion.radius_m) * pattern;
  }
  return weights;
}

AccelerationNoise::Weights AccelerationNoise::MeanWeights(const Accelerations& by) const noexcept {
  Weights weights{};
  for (size_t order = 0; order < 2; ++order) {
    double total_square = 0, sum = 0;
    for (size_t i = kFirstHarmonic[order]; i < kFirstHarmonic[order + 1]; ++i) {
      double harmonic = 0;
      for (size_t motion = 0; motion < kMotions; ++motion) {
        const RigidRadiation::Motion& of = moved_.body.motions[motion];
        const double part = by[motion] * Square(of.radius_m) * of.strengths[i];
        harmonic += part;
        weights[2 * motion + order] += part * part;
      }
      total_square += harmonic * harmonic;
    }
    for (size_t motion = 0; motion < kMotions; ++motion) {
      sum += weights[2 * motion + order] = std::sqrt(weights[2 * motion + order]);
    }
    if (!(sum > 0)) continue;
    const double share = scale_ * std::sqrt(total_square / (4 * kPi)) / sum;
    for (size_t motion = 0; motion < kMotions; ++motion) weights[2 * motion + order] *= share;
  }
  return weights;
}

/// H(i W) of a source.
AccelerationNoise::Number AccelerationNoise::ResponseAt(size_t source,
                                                        double rad_per_s) const noexcept {
  const double x =
      rad_per_s * moved_.body.motions[source / 2].radius_m / moved_.sound_speed_m_per_s;
  const double xx = x * x;
  const bool dipole = source % 2 == 0;
  // The denominator's parts, and the numerator i x or -x^2.
  const double re = dipole ? 2 - xx : 9 - 4 * xx, im = dipole ? 2 * x : x * (9 - xx);
  const double square = re * re + im * im;
  if (dipole) return {.re = x * im / square, .im = x * re / square};
  return {.re = -xx * re / square, .im = xx * im / square};
}

/// Adds sign times K exp(p t)/T to the states, for the weights of a pulse.
void AccelerationNoise::Kick(const ActivePulse& pulse, double sign, double time_s) noexcept {
  const double ww = Square(2 * kPi / pulse.duration_s);
  for (Pole& pole : std::span(poles_).first(pole_count_)) {
    const double weight = sign * pulse.weights[pole.source] / pulse.duration_s;
    if (weight == 0) continue;
    // p (p^2 + W^2)
    const auto [x, y] = pole.p;
    const double re = x * (x * x - 3 * y * y + ww), im = y * (3 * x * x - y * y + ww);
    const double factor = weight * ww * std::exp(x * time_s) / (re * re + im * im);
    const Number k{.re = factor * (pole.residue.re * re + pole.residue.im * im),
                   .im = factor * (pole.residue.im * re - pole.residue.re * im)};
    const double cosine = std::cos(y * time_s), sine = std::sin(y * time_s);
    pole.state.re += k.re * cosine - k.im * sine;
    pole.state.im += k.re * sine + k.im * cosine;
  }
}

void AccelerationNoise::RenderAdd(std::span<float> frames) noexcept {
  std::array<float, kMostBlockFrames> block{};
  const std::span<float> sound = std::span(block).first(frames.size());
  for (size_t at = 0; at < sound.size();) {
    const size_t next = StartAndEndPulses(at, sound.size());
    RenderPart(sound.subspan(at, next - at));
    at = next;
  }
  for (ActivePulse& pulse : pulses_) {
    pulse.begin = 0;
    pulse.end -= sound.size();
  }
  NoteDecay();
  constexpr auto kMost = static_cast<float>(kMostAmplitude);
  for (size_t n = 0; n < sound.size(); ++n) frames[n] += std::clamp(sound[n], -kMost, kMost);
}

/// Starts and ends the pulses that are due at frame `at`. Returns the next frame at which a pulse
/// starts or ends, at most `frame_count`.
size_t AccelerationNoise::StartAndEndPulses(size_t at, size_t frame_count) noexcept {
  size_t next = frame_count;
  for (ActivePulse& pulse : pulses_) {
    if (pulse.begin <= at && !std::exchange(pulse.begun, true)) Kick(pulse, 1, pulse.lead_s);
    if (pulse.end == at) Kick(pulse, -1, pulse.end_lead_s);
    if (pulse.begin > at) next = std::min(next, pulse.begin);
    if (pulse.end > at) next = std::min(next, pulse.end);
  }
  pulses_.EraseIf([at](const ActivePulse& pulse) { return pulse.end == at; });
  return next;
}

void AccelerationNoise::RenderPart(std::span<float> frames) noexcept {
  const auto add = [frames](Number z, Number step) {
    for (float& frame : frames) {
      frame += static_cast<float>(z.re);
      z = {.re = z.re * step.re - z.im * step.im, .im = z.re * step.im + z.im * step.re};
    }
    return z;
  };
  for (ActivePulse& pulse : pulses_) {
    if (pulse.begun) pulse.phasor = add(pulse.phasor, pulse.turn);
  }
  for (Pole& pole : std::span(poles_).first(pole_count_)) pole.state = add(pole.state, pole.step);
}

void AccelerationNoise::NoteDecay() noexcept {
  double loudest = 0;
  for (const Pole& pole : std::span(poles_).first(pole_count_)) {
    loudest = std::max({loudest, std::abs(pole.state.re), std::abs(pole.state.im)});
  }
  decaying_ = loudest > kSilence;
  if (!active()) Silence();
}

void AccelerationNoise::Silence() noexcept {
  pulses_.clear();
  for (Pole& pole : poles_) pole.state = {};
  decaying_ = false;
}

}  // namespace carillon
