// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/room_decay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

#include "client_sdk/fit/esprit.h"

namespace carillon::fit {
namespace {

using Complex = std::complex<double>;

/// The rooms that are tried, of which each is faster by the same factor, with the share of a
/// microphone near the body, from which the level of each mode's own tail departs. The bands that
/// they are tried on.
constexpr std::array<double, 8> kRoomDecays_per_s = {7, 9.3, 12.4, 16.5, 22, 29.3, 39, 52};
constexpr double kShare = 0.1, kMostLevel = 3;
constexpr size_t kMostBands = 12, kMostModes = 6;
/// Nepers that one band may vote with, and by which a room must be better than none.
constexpr double kVote = 12, kLeastGain = 25;
/// Part of all votes by which it must be better.
constexpr double kLeastAgreed = 0.25;
/// The part of a ring that is used: after the blow, and as long as a room may be heard. Every
/// second sample is, because a band is half as wide as its rate: the filter takes the room's noise
/// for white.
constexpr double kStart_s = 0.0075, kUsed_s = 0.8;
constexpr size_t kEvery = 2;
/// A room lets fast modes seem slower than they are, and leaves slow ones as they are: no decay is
/// less than this part of what it seems to be.
constexpr double kSlowest = 0.65;
/// What the model does not have, relative to the strongest sample.
constexpr double kUnknown = 1e-5;

/// A product without the care for infinities that costs the most of the time of operator*.
Complex Product(const Complex& a, const Complex& b) {
  return {a.real() * b.real() - a.imag() * b.imag(), a.real() * b.imag() + a.imag() * b.real()};
}

Complex PoleOf(const BandMode& mode, double rate_hz) {
  return std::exp(Complex(-mode.decay_per_s, 2 * std::numbers::pi * mode.frequency_hz) / rate_hz);
}

/// The filter of one ring, of which the covariance and the predictions are for all modes at once.
class RingFilter {
 public:
  RingFilter(const BandRings::Ring& ring, const std::vector<BandMode>& modes)
      : rate_hz_(ring.rate_hz / kEvery), count_(modes.size()) {
    for (size_t n = 0; n < ring.samples.size(); n += kEvery) samples_.push_back(ring.samples[n]);
    start_ = static_cast<size_t>(std::lround(kStart_s * rate_hz_));
    end_ = std::min(samples_.size(), static_cast<size_t>(kUsed_s * rate_hz_));
    if (end_ < start_ + 4 * count_ + 8) {
      end_ = start_;
      return;
    }
    std::vector<Complex> poles;
    poles.reserve(modes.size());
    for (const BandMode& mode : modes) poles.push_back(PoleOf(mode, rate_hz_));
    const auto window = Signal(samples_).subspan(start_, end_ - start_);
    for (const Complex& a : Amplitudes(window, poles)) power_.push_back(std::norm(a));
    double most = 0;
    for (const Complex& x : window) most = std::max(most, std::norm(x));
    noise_ = ring.noise + kUnknown * most + 1e-300;
  }

  /// The log likelihood, less a constant, with the amplitudes that fit best. `levels` has, for each
  /// mode, the logarithm of the power of its tail over that of a usual room.
  double LogLikelihood(const std::vector<BandMode>& modes, const std::vector<double>& levels,
                       const Room& room) const {
    if (end_ == start_) return 0;
    const size_t m = count_, width = m + 1;
    std::vector<Complex> poles, covariance(m * m), states(m * width), direct(m, 1.0), gain(m);
    const double start_s = static_cast<double>(start_) / rate_hz_;
    std::vector<double> drive(m);
    for (size_t k = 0; k < m; ++k) {
      poles.push_back(PoleOf(modes[k], rate_hz_));
      const double d = modes[k].decay_per_s, apart = 2 * (d - room.decay_per_s);
      const double onset_power = power_[k] * std::exp(2 * d * start_s);
      drive[k] = onset_power * 2 * room.decay_per_s * room.share * std::exp(levels[k]);
      const double grown = std::abs(apart) < 1e-6 ? start_s : std::expm1(apart * start_s) / apart;
      covariance[k * m + k] = drive[k] * std::exp(-2 * d * start_s) * grown;
    }
    // Row and column 0 of the normal equations are the signal's.
    std::vector<Complex> normal(width * width);
    double log_sum = 0;
    std::vector<Complex> innovation(width);
    for (size_t n = start_; n < end_; ++n) {
      const double t = static_cast<double>(n) / rate_hz_;
      double variance = noise_;
      for (size_t j = 0; j < m; ++j) {
        gain[j] = 0;
        for (size_t k = 0; k < m; ++k) gain[j] += covariance[j * m + k];
        variance += gain[j].real();
      }
      variance = std::max(variance, noise_);
      log_sum += std::log(variance);
      innovation[0] = samples_[n];
      for (size_t k = 0; k < m; ++k) innovation[k + 1] = direct[k];
      for (size_t s = 0; s < width; ++s) {
        for (size_t k = 0; k < m; ++k) innovation[s] -= states[k * width + s];
      }
      for (size_t r = 0; r < width; ++r) {
        for (size_t s = 0; s <= r; ++s) {
          normal[r * width + s] += Product(std::conj(innovation[r]), innovation[s]) / variance;
        }
      }
      for (size_t j = 0; j < m; ++j) {
        const Complex part = gain[j] / variance;
        for (size_t k = 0; k < m; ++k) covariance[j * m + k] -= Product(part, std::conj(gain[k]));
        for (size_t s = 0; s < width; ++s) states[j * width + s] += Product(part, innovation[s]);
      }
      const double now = std::exp(-2 * room.decay_per_s * t) / rate_hz_;
      for (size_t j = 0; j < m; ++j) {
        for (size_t k = 0; k < m; ++k) {
          covariance[j * m + k] =
              Product(Product(poles[j], covariance[j * m + k]), std::conj(poles[k]));
        }
        covariance[j * m + j] += drive[j] * now;
        for (size_t s = 0; s < width; ++s)
          states[j * width + s] = Product(poles[j], states[j * width + s]);
        direct[j] = Product(direct[j], poles[j]);
      }
    }
    // Lines that were not found, or a hammer's touch, raise what is left over all that is known.
    const auto samples = static_cast<double>(end_ - start_);
    const double left = Unexplained(normal, width);
    const double scale = std::max(1.0, left / samples);
    return -log_sum - samples * std::log(scale) - left / scale;
  }

 private:
  /// The energy of the whitened signal that no sum of the whitened modes explains: the last step of
  /// eliminating the modes from the normal equations.
  static double Unexplained(std::vector<Complex>& normal, size_t width) {
    for (size_t p = width - 1; p > 0; --p) {
      const double pivot = normal[p * width + p].real();
      if (pivot <= 1e-300) continue;
      for (size_t r = 0; r < p; ++r) {
        for (size_t s = 0; s <= r; ++s) {
          normal[r * width + s] -=
              Product(std::conj(normal[p * width + r]), normal[p * width + s]) / pivot;
        }
      }
    }
    return normal[0].real();
  }

  std::vector<Complex> samples_;
  double rate_hz_;
  size_t count_, start_ = 0, end_ = 0;
  std::vector<double> power_;
  double noise_ = 0;
};

/// The decays and the levels of a band's modes, which are varied until they explain the band best.
struct Explanation {
  std::vector<BandMode> modes;
  std::vector<std::vector<double>> levels;  ///< #rings by #modes
};

/// The likelihood of a band.
class BandLikelihood {
 public:
  explicit BandLikelihood(const BandRings& band) {
    for (const BandRings::Ring& ring : band.rings) filters_.emplace_back(ring, band.modes);
  }

  double operator()(const Explanation& tried, const Room& room) const {
    double sum = 0;
    for (size_t r = 0; r < filters_.size(); ++r) {
      sum += filters_[r].LogLikelihood(tried.modes, tried.levels[r], room);
    }
    return sum;
  }

  Explanation Beginning(const std::vector<BandMode>& modes) const {
    return {.modes = modes,
            .levels = std::vector(filters_.size(), std::vector<double>(modes.size()))};
  }

  /// Climbs by steps of decays, frequencies, and levels of tails. Returns the likelihood reached.
  double Climb(Explanation& best, const Room& room, std::span<const double> steps) const {
    const std::vector<BandMode> first = best.modes;
    double most = (*this)(best, room);
    for (const double step : steps) {
      for (size_t k = 0; k < first.size(); ++k) {
        const auto decay = [&](Explanation& tried, double sign) {
          tried.modes[k].decay_per_s *= std::exp(sign * step);
          return tried.modes[k].decay_per_s >= kSlowest * first[k].decay_per_s;
        };
        const auto frequency = [&](Explanation& tried, double sign) {
          tried.modes[k].frequency_hz += sign * step * tried.modes[k].decay_per_s / 10;
          return true;
        };
        Try(decay, room, best, most);
        Try(frequency, room, best, most);
        if (room.share == 0) continue;
        for (size_t r = 0; r < filters_.size(); ++r) {
          const auto level = [&](Explanation& tried, double sign) {
            tried.levels[r][k] += sign * 3 * step;
            return std::abs(tried.levels[r][k]) <= kMostLevel;
          };
          Try(level, room, best, most);
        }
      }
    }
    return most;
  }

 private:
  /// Moves up or down as long as the move is allowed and helps.
  template <typename Move>
  void Try(const Move& move, const Room& room, Explanation& best, double& most) const {
    for (const double sign : {1.0, -1.0}) {
      bool moved = false;
      for (int times = 0; times < 6; ++times) {
        Explanation tried = best;
        if (!move(tried, sign)) break;
        const double reached = (*this)(tried, room);
        if (reached <= most) break;
        best = std::move(tried), most = reached, moved = true;
      }
      if (moved) return;
    }
  }

  std::vector<RingFilter> filters_;
};

/// Returns where a parabola through three evenly spaced values is least, in steps from the middle.
double LeastBetween(double before, double middle, double after) {
  const double bend = before - 2 * middle + after;
  return bend > 0 ? std::clamp((before - after) / (2 * bend), -0.5, 0.5) : 0;
}

/// Returns the room that most bands are content with. A band in which something else than the room
/// deviates, such as a mode that was not found, has no more than one vote.
Room Elect(const std::vector<BandRings>& bands, const std::vector<BandLikelihood>& likelihoods,
           const std::vector<Room>& rooms) {
  constexpr std::array<double, 2> kSteps = {0.2, 0.07};
  std::vector<double> losses(rooms.size());
  for (size_t b = 0; b < bands.size(); ++b) {
    std::vector<double> reached;
    for (const Room& room : rooms) {
      Explanation explanation = likelihoods[b].Beginning(bands[b].modes);
      reached.push_back(likelihoods[b].Climb(explanation, room, kSteps));
    }
    const double most = *std::ranges::max_element(reached);
    for (size_t r = 0; r < rooms.size(); ++r) losses[r] += std::min(kVote, most - reached[r]);
  }
  const auto best = static_cast<size_t>(std::ranges::min_element(losses) - losses.begin());
  const double least_gain =
      std::max(kLeastGain, kLeastAgreed * kVote * static_cast<double>(bands.size()));
  if (losses[0] - losses[best] <= least_gain) return rooms[0];
  Room room = rooms[best];
  if (best > 1 && best + 1 < rooms.size()) {
    const double step = LeastBetween(losses[best - 1], losses[best], losses[best + 1]);
    room.decay_per_s *= std::pow(room.decay_per_s / rooms[best - 1].decay_per_s, step);
  }
  return room;
}

void KeepDecaying(BandRings& band) {
  for (BandMode& mode : band.modes) mode.decay_per_s = std::max(0.1, mode.decay_per_s);
}

}  // namespace

Room FindRoom(std::vector<BandRings> bands) {
  std::erase_if(bands, [](const BandRings& band) {
    return band.modes.empty() || band.modes.size() > kMostModes;
  });
  // The bands of which most is heard above the noise.
  std::ranges::sort(bands, std::greater(), [](const BandRings& band) {
    double heard = 0;
    for (const auto& ring : band.rings) {
      for (const Complex& x : ring.samples) heard += std::norm(x) / (ring.noise + 1e-300);
    }
    return heard;
  });
  if (bands.size() > kMostBands) bands.resize(kMostBands);
  std::vector<BandLikelihood> likelihoods;
  for (BandRings& band : bands) {
    KeepDecaying(band);
    likelihoods.emplace_back(band);
  }
  std::vector<Room> rooms = {Room()};
  for (const double decay : kRoomDecays_per_s) {
    rooms.push_back({.decay_per_s = decay, .share = kShare});
  }
  return Elect(bands, likelihoods, rooms);
}

void RefineInRoom(const Room& room, BandRings& band) {
  if (band.modes.empty() || band.modes.size() > 2 * kMostModes) return;
  KeepDecaying(band);
  const BandLikelihood likelihood(band);
  constexpr std::array<double, 4> kSteps = {0.25, 0.1, 0.04, 0.015};
  const Explanation first = likelihood.Beginning(band.modes);
  Explanation best = first;
  const double most = likelihood.Climb(best, room, kSteps);
  for (size_t k = 0; k < band.modes.size(); ++k) {
    constexpr double kStep = 0.1;
    const double decay = best.modes[k].decay_per_s;
    double fall = 0;
    for (const double sign : {1.0, -1.0}) {
      Explanation tried = best;
      tried.modes[k].decay_per_s *= std::exp(sign * kStep);
      fall += (most - likelihood(tried, room)) / 2;
    }
    band.modes[k] = best.modes[k];
    // What still falls at its bound is no sum of these modes in the room.
    const bool bounded = decay < 1.03 * kSlowest * first.modes[k].decay_per_s;
    band.modes[k].decay_error_per_s =
        bounded ? decay : decay * std::min(3.0, kStep / std::sqrt(2 * std::max(1e-6, fall)));
  }
}

}  // namespace carillon::fit
