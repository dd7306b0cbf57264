// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/bank/degenerate_modes.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <queue>
#include <span>
#include <vector>

namespace carillon {
namespace {

constexpr double kIsolation = 4;

/// Relative difference of two neighbours' frequencies; infinite if they are not a pair.
double Split(const SoundingMode& a, const SoundingMode& b, double tolerance) {
  const auto [less, more] = std::minmax(a.coupling, b.coupling);
  const double split = b.natural_frequency_hz / a.natural_frequency_hz - 1;
  return split <= tolerance && more < 2 * less ? split : std::numeric_limits<double>::infinity();
}

/// Gives the modes their mean frequency, decay and, if `couplings`, the root mean square of their
/// couplings.
void ShareMeans(std::span<SoundingMode* const> modes, bool couplings) {
  const auto share = [&](double SoundingMode::*figure, int power) {
    double sum = 0;
    for (const SoundingMode* mode : modes) sum += std::pow(mode->*figure, power);
    const double mean = std::pow(sum / static_cast<double>(modes.size()), 1.0 / power);
    for (SoundingMode* mode : modes) mode->*figure = mean;
  };
  share(&SoundingMode::natural_frequency_hz, 1);
  share(&SoundingMode::damped_rad_per_s, 1);
  share(&SoundingMode::decay_rate_per_s, 1);
  if (couplings) share(&SoundingMode::coupling, 2);
}

/// Two modes between which no single mode lies.
struct Neighbours {
  double split = 0;
  size_t first = 0;
  size_t second = 0;
  auto operator<=>(const Neighbours&) const = default;
};

/// The modes that have no partner yet, in ascending order of frequency, and their neighbours.
class SingleModes {
 public:
  SingleModes(std::span<SoundingMode* const> modes, double tolerance)
      : modes_(modes),
        tolerance_(tolerance),
        before_(modes.size()),
        after_(modes.size()),
        taken_(modes.size()) {
    for (size_t i = 0; i < modes.size(); ++i) {
      // The first mode has none before it: i - 1 is then the greatest number, which is no index.
      before_[i] = i - 1;
      after_[i] = i + 1;
    }
    for (size_t i = 1; i < modes.size(); ++i) Push(i - 1, i);
  }

  /// Removes the pair of closest neighbours, and returns it. Returns nothing if no pair is left.
  std::optional<Neighbours> TakeClosest() {
    while (!candidates_.empty()) {
      const Neighbours closest = candidates_.top();
      candidates_.pop();
      if (taken_[closest.first] || taken_[closest.second]) continue;
      taken_[closest.first] = taken_[closest.second] = true;
      const size_t before = before_[closest.first];
      const size_t after = after_[closest.second];
      if (before < modes_.size()) after_[before] = after;
      if (after < modes_.size()) before_[after] = before;
      if (before < modes_.size() && after < modes_.size()) Push(before, after);
      return closest;
    }
    return std::nullopt;
  }

 private:
  void Push(size_t first, size_t second) {
    const double split = Split(*modes_[first], *modes_[second], tolerance_);
    if (std::isfinite(split)) candidates_.push({split, first, second});
  }

  const std::span<SoundingMode* const> modes_;
  const double tolerance_;
  std::vector<size_t> before_;
  std::vector<size_t> after_;
  std::vector<bool> taken_;
  std::priority_queue<Neighbours, std::vector<Neighbours>, std::greater<>> candidates_;
};

/// Returns the relative distance from mode `i` to the next mode; infinite where there is none.
double Gap(std::span<const SoundingMode> modes, size_t i) {
  if (i >= modes.size() || i + 1 >= modes.size()) return std::numeric_limits<double>::infinity();
  return modes[i + 1].natural_frequency_hz / modes[i].natural_frequency_hz - 1;
}

/// Returns the number of modes of the largest multiplet that begins with mode `first`, or one.
size_t MultipletSize(std::span<const SoundingMode> modes, size_t first, double tolerance) {
  size_t size = 1;
  double least = modes[first].coupling, most = least;
  for (size_t last = first + 1; last < modes.size(); ++last) {
    const double width = modes[last].natural_frequency_hz / modes[first].natural_frequency_hz - 1;
    least = std::min(least, modes[last].coupling);
    most = std::max(most, modes[last].coupling);
    if (width > tolerance || most >= 2 * least) break;
    const double nearest = std::min(Gap(modes, first - 1), Gap(modes, last));
    if (last - first >= 2 && nearest >= kIsolation * width) size = last - first + 1;
  }
  return size;
}

/// Joins the multiplets, and returns the other modes.
std::vector<SoundingMode*> JoinMultiplets(const SoundingBand& band,
                                          std::vector<SoundingMode>& modes) {
  const std::vector<SoundingMode> given = modes;
  std::vector<SoundingMode*> others;
  uint32_t multiplet = 0;
  for (size_t first = 0; first < modes.size();) {
    const size_t size = MultipletSize(given, first, band.pair_tolerance);
    std::vector<SoundingMode*> joined;
    for (size_t i = first; i < first + size; ++i) joined.push_back(&modes[i]);
    first += size;
    if (size == 1) {
      others.push_back(joined.front());
      continue;
    }
    ShareMeans(joined, !band.directed);
    if (band.directed) continue;
    ++multiplet;
    for (SoundingMode* mode : joined) mode->multiplet = multiplet;
  }
  return others;
}

}  // namespace

void JoinDegenerateModes(const SoundingBand& band, std::vector<SoundingMode>& modes) {
  const std::vector<SoundingMode*> others = JoinMultiplets(band, modes);
  SingleModes single(others, band.pair_tolerance);
  while (const std::optional<Neighbours> pair = single.TakeClosest()) {
    SoundingMode* const both[] = {others[pair->first], others[pair->second]};
    ShareMeans(both, !band.directed);
    if (!band.directed) both[1]->output_phase_rad = std::numbers::pi / 2;
  }
}

}  // namespace carillon
