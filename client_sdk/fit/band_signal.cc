// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/band_signal.h"

#include <algorithm>
#include <cmath>
#include <kissfft/kissfft.hh>
#include <numbers>

namespace carillon::fit {
namespace {

/// Width of the cosine by which a band fades out, Hz.
constexpr double kFlank_hz = 140;
/// A transform takes a multiple of this time, which has a whole number of samples at the usual
/// rates and of a band.
constexpr double kQuantum_s = 0.04;
/// The padding behind the sound, into which the filter blurs its end instead of into its beginning.
constexpr double kPadding_s = 0.04;

/// Returns the least number from `count` on without a prime factor above five.
size_t NextSmooth(size_t count) {
  for (;; ++count) {
    size_t rest = count;
    for (const size_t factor : {2U, 3U, 5U}) {
      while (rest % factor == 0) rest /= factor;
    }
    if (rest == 1) return count;
  }
}

}  // namespace

BandSignals::BandSignals(const std::vector<float>& samples, double sample_rate_hz) {
  const double seconds = static_cast<double>(samples.size()) / sample_rate_hz;
  const size_t quanta =
      NextSmooth(static_cast<size_t>(std::ceil((seconds + kPadding_s) / kQuantum_s)));
  const double padded_s = static_cast<double>(quanta) * kQuantum_s;
  const auto count = static_cast<size_t>(std::lround(padded_s * sample_rate_hz));
  size_ = static_cast<size_t>(std::lround(padded_s * kBandRate_hz));
  bins_per_hz_ = static_cast<double>(count) / sample_rate_hz;
  rate_hz_ = static_cast<double>(size_) / bins_per_hz_;
  used_size_ = std::min(size_, static_cast<size_t>(seconds * rate_hz_));
  std::vector<std::complex<double>> padded(count);
  std::copy(samples.begin(), samples.end(), padded.begin());
  spectrum_.resize(count);
  kissfft<double>(count, false).transform(padded.data(), spectrum_.data());
  spectrum_.resize(count / 2);
}

std::vector<std::complex<double>> BandSignals::Cut(double& centre_hz) const {
  const auto centre = static_cast<std::ptrdiff_t>(std::lround(centre_hz * bins_per_hz_));
  centre_hz = static_cast<double>(centre) / bins_per_hz_;
  const auto width = static_cast<std::ptrdiff_t>((kHalfBand_hz + kFlank_hz) * bins_per_hz_);
  const auto size = static_cast<std::ptrdiff_t>(size_);
  std::vector<std::complex<double>> bins(size_), band(size_);
  for (std::ptrdiff_t b = -width; b <= width; ++b) {
    const std::ptrdiff_t from = centre + b;
    if (from <= 0 || from >= static_cast<std::ptrdiff_t>(spectrum_.size())) continue;
    const double beyond = std::abs(static_cast<double>(b)) / bins_per_hz_ - kHalfBand_hz;
    const double cosine = std::cos(std::numbers::pi / 2 * std::max(0.0, beyond) / kFlank_hz);
    bins[static_cast<size_t>((b + size) % size)] =
        cosine * cosine * spectrum_[static_cast<size_t>(from)];
  }
  kissfft<double>(size_, true).transform(bins.data(), band.data());
  band.resize(used_size_);
  // Two for the negative frequencies.
  const double scale = 2 / static_cast<double>(2 * spectrum_.size());
  for (std::complex<double>& sample : band) sample *= scale;
  return band;
}

}  // namespace carillon::fit
