// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace carillon::fit {

/// Half of the width of a band, Hz, in which lines are looked for; beyond it the band fades out.
inline constexpr double kHalfBand_hz = 200;
/// Number of samples a second of a band, about which rate_hz() says how exact it is.
inline constexpr double kBandRate_hz = 800;

/// Cuts bands from a sound: each becomes a complex signal of few samples, in which a component of
/// frequency f turns with f minus the band's centre.
class BandSignals {
 public:
  /// The sound begins at `samples[0]`.
  BandSignals(const std::vector<float>& samples, double sample_rate_hz);

  /// Returns the band of 2 kHalfBand_hz around the centre nearest to `centre_hz` that it can have,
  /// which is set. The filter blurs the signal by some 7 ms.
  std::vector<std::complex<double>> Cut(double& centre_hz) const;

  /// Samples a second of a band: kBandRate_hz, or nearly so where the rate of the sound is unusual.
  double rate_hz() const { return rate_hz_; }

 private:
  double rate_hz_;
  double bins_per_hz_;
  size_t size_;       ///< of a band, with what was padded
  size_t used_size_;  ///< of a band
  std::vector<std::complex<double>> spectrum_;
};

}  // namespace carillon::fit
