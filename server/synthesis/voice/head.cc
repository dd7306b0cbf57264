// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/head.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "server/synthesis/voice/delay_line.h"
#include "server/synthesis/voice/vector3.h"

namespace carillon {
namespace {

constexpr double kPi = std::numbers::pi;
/// The onset of a response is where it first reaches this part of its greatest sample.
constexpr float kOnset = 0.1F;
/// Frames that are kept before the onset.
constexpr double kBefore = 16;
/// The part of a response that is kept. KEMAR's responses last 11.6 ms, and the last millisecond of
/// the quieter ear is 30 dB below the whole.
constexpr double kLength_s = 0.0125;
/// The last taps fade out.
constexpr size_t kFadeTaps = 32;
/// Each direction of the grid is interpolated between the four nearest measured ones.
constexpr size_t kNeighbours = 4;

double OnsetOf(std::span<const float> response) {
  float greatest = 0;
  for (const float sample : response) greatest = std::max(greatest, std::abs(sample));
  const float level = kOnset * greatest;
  if (greatest == 0) return 0;
  float before = 0;
  for (size_t n = 0; n < response.size(); ++n) {
    const float now = std::abs(response[n]);
    if (now >= level) return static_cast<double>(n) - (now - level) / (now - before);
    before = now;
  }
  return 0;
}

/// Splits a measured response at its onset.
EarResponse Split(std::span<const float> response, double delay_frames, size_t tap_count) {
  const double first = OnsetOf(response) - kBefore;
  // Silence stands before and after the response. The frame i of the response is then `last - i`
  // frames before the end of the line.
  const std::vector<float> silence(tap_count + DelayLine::kTaps);
  DelayLine line(2 * silence.size() + response.size(), 0);
  for (const auto part : {std::span<const float>(silence), response, {silence}}) line.Write(part);
  const auto last = static_cast<double>(response.size() + silence.size());
  EarResponse split{.taps = std::vector<float>(tap_count),
                    .delay_frames = static_cast<float>(delay_frames + first)};
  for (size_t n = 0; n < tap_count; ++n) {
    const double left = static_cast<double>(tap_count - n) / (kFadeTaps + 1);
    const double fade = left < 1 ? (1 - std::cos(kPi * left)) / 2 : 1;
    split.taps[n] = static_cast<float>(fade) * line.Read(last - first - static_cast<double>(n));
  }
  return split;
}

/// The polar angles of a direction, radians: from straight ahead to the right, and upwards.
struct Angles {
  double azimuth = 0, elevation = 0;
};

Angles AnglesOf(const Vector3& d) {
  return {.azimuth = std::atan2(d[0], -d[2]),
          .elevation = std::atan2(d[1], std::hypot(d[0], d[2]))};
}

Vector3 DirectionOf(const Angles& angles) {
  const double level = std::cos(angles.elevation);
  return {level * std::sin(angles.azimuth), std::sin(angles.elevation),
          -level * std::cos(angles.azimuth)};
}

Vector3 Unit(const Vector3& v) {
  const double length = Length(v);
  return length > 0 ? Vector3{v[0] / length, v[1] / length, v[2] / length} : Vector3{0, 0, -1};
}

void Add(const EarResponses& from, double weight, EarResponses& to) {
  const auto scale = static_cast<float>(weight);
  for (size_t ear = 0; ear < to.size(); ++ear) {
    for (size_t n = 0; n < to[ear].taps.size(); ++n) to[ear].taps[n] += scale * from[ear].taps[n];
    to[ear].delay_frames += scale * from[ear].delay_frames;
  }
}

/// Returns the mean power of a response from 0 to 10 kHz.
double PowerOf(const EarResponse& response, double sample_rate_hz) {
  constexpr double kHighest_hz = 10000;
  constexpr int kCount = 100;
  double power = 0;
  for (int i = 0; i < kCount; ++i) {
    const double turn = -2 * kPi * kHighest_hz * (i + 0.5) / kCount / sample_rate_hz;
    std::complex<double> sum = 0;
    for (size_t n = 0; n < response.taps.size(); ++n) {
      sum += static_cast<double>(response.taps[n]) * std::polar(1.0, turn * static_cast<double>(n));
    }
    power += std::norm(sum) / kCount;
  }
  return power;
}

/// A measured direction by its angle from another, radians.
struct Neighbour {
  double angle = 0;
  size_t index = 0;
};

/// Returns the mean of the nearest measured directions, weighted by the inverse square of their
/// angles. `mean` holds zeros.
EarResponses Interpolate(const Vector3& direction, std::span<const Vector3> directions,
                         std::span<const EarResponses> split, EarResponses mean) {
  std::vector<Neighbour> near;
  for (size_t i = 0; i < directions.size(); ++i) {
    near.push_back({std::acos(std::clamp(Dot(direction, directions[i]), -1.0, 1.0)), i});
  }
  const size_t count = std::min(kNeighbours, near.size());
  std::ranges::partial_sort(near, near.begin() + static_cast<std::ptrdiff_t>(count), {},
                            &Neighbour::angle);
  near.resize(count);
  constexpr double kSame = 1e-3;
  double sum = 0;
  for (Neighbour& neighbour : near) {
    neighbour.angle = 1 / (kSame * kSame + neighbour.angle * neighbour.angle);
    sum += neighbour.angle;
  }
  for (const Neighbour& neighbour : near) Add(split[neighbour.index], neighbour.angle / sum, mean);
  return mean;
}

}  // namespace

Head::Head(std::span<const MeasuredDirection> measured, double sample_rate_hz)
    : tap_count_(static_cast<size_t>(std::ceil(kLength_s * sample_rate_hz))),
      grid_(kAzimuths * kElevations) {
  std::vector<Vector3> directions;
  std::vector<EarResponses> split;
  for (const MeasuredDirection& each : measured) {
    directions.push_back(Unit(each.direction));
    EarResponses& responses = split.emplace_back();
    for (size_t ear = 0; ear < responses.size(); ++ear) {
      responses[ear] = Split(each.responses[ear], each.delay_frames[ear], tap_count_);
    }
  }
  for (size_t row = 0; row < kElevations; ++row) {
    for (size_t column = 0; column < kAzimuths; ++column) {
      const Angles angles{.azimuth = 2 * kPi * static_cast<double>(column) / kAzimuths,
                          .elevation = kPi * (static_cast<double>(row) / (kElevations - 1) - 0.5)};
      grid_[row * kAzimuths + column] =
          Interpolate(DirectionOf(angles), directions, split, Silent());
    }
  }
  EarResponses ahead = Silent();
  Respond({0, 0, -1}, ahead);
  const double power = (PowerOf(ahead[0], sample_rate_hz) + PowerOf(ahead[1], sample_rate_hz)) / 2;
  const auto scale = static_cast<float>(power > 0 ? 1 / std::sqrt(power) : 0);
  float shortest = grid_[0][0].delay_frames, longest = shortest;
  for (const EarResponses& responses : grid_) {
    for (const EarResponse& ear : responses) {
      shortest = std::min(shortest, ear.delay_frames);
      longest = std::max(longest, ear.delay_frames);
    }
  }
  for (EarResponses& responses : grid_) {
    for (EarResponse& ear : responses) {
      ear.delay_frames -= shortest;
      for (float& tap : ear.taps) tap *= scale;
    }
  }
  longest_delay_ = longest - shortest;
}

std::array<Head::Share, 4> Head::SharesOf(const Vector3& direction) noexcept {
  const Angles angles = AnglesOf(direction);
  const double turn = angles.azimuth / (2 * kPi);
  const double x = (turn - std::floor(turn)) * kAzimuths;
  const double y = std::clamp((angles.elevation / kPi + 0.5) * (kElevations - 1), 0.0,
                              static_cast<double>(kElevations - 1));
  const auto column = std::min(static_cast<size_t>(x), kAzimuths - 1);
  const auto row = std::min(static_cast<size_t>(y), kElevations - 2);
  const double right = x - static_cast<double>(column), up = y - static_cast<double>(row);
  const size_t low = row * kAzimuths, high = low + kAzimuths, next = (column + 1) % kAzimuths;
  return {{{low + column, (1 - right) * (1 - up)},
           {low + next, right * (1 - up)},
           {high + column, (1 - right) * up},
           {high + next, right * up}}};
}

EarResponses Head::Silent() const {
  const EarResponse silent{.taps = std::vector<float>(tap_count_)};
  return {silent, silent};
}

void Head::Respond(const Vector3& direction, EarResponses& responses) const noexcept {
  for (EarResponse& ear : responses) {
    std::ranges::fill(ear.taps, 0.0F);
    ear.delay_frames = 0;
  }
  for (const Share& share : SharesOf(direction)) Add(grid_[share.index], share.weight, responses);
}

std::array<double, 2> Head::Delays(const Vector3& direction) const noexcept {
  std::array<double, 2> delays{};
  for (const Share& share : SharesOf(direction)) {
    for (size_t ear = 0; ear < delays.size(); ++ear) {
      delays[ear] += share.weight * grid_[share.index][ear].delay_frames;
    }
  }
  return delays;
}

}  // namespace carillon
