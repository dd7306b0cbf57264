// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace carillon {

/// The larger value, or the one that is not a number, which std::max would pass over.
inline double Larger(double a, double b) { return a >= b || std::isnan(a) ? a : b; }

/// The largest magnitude of a sample.
template <class Sound>
double Peak(const Sound& sound) {
  double peak = 0;
  for (const auto sample : sound) peak = Larger(peak, std::abs(double{sample}));
  return peak;
}

/// The largest difference of two samples of the same number.
template <class Sound>
double LargestDifference(const Sound& a, const Sound& b) {
  double largest = 0;
  for (size_t n = 0; n < a.size(); ++n) largest = Larger(largest, std::abs(double{a[n]} - b[n]));
  return largest;
}

template <class Sound>
double Energy(const Sound& sound) {
  double sum = 0;
  for (const auto sample : sound) sum += double{sample} * sample;
  return sum;
}

/// Root of the mean square.
inline double Rms(std::span<const float> sound) {
  return std::sqrt(Energy(sound) / static_cast<double>(sound.size()));
}

/// Number of the first frame that is not silent, or of frames.
inline size_t Onset(const std::vector<float>& sound) {
  return static_cast<size_t>(std::ranges::find_if(sound, [](float x) { return x != 0; }) -
                             sound.begin());
}

}  // namespace carillon
