// SPDX-License-Identifier: Apache-2.0
// STK's resonant two-pole filters, as its class Modal uses them, for as many modes as asked:
// stk_peer MODES SECONDS < population
#include <stk/BiQuad.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

int main(int count, char** values) {
  if (count < 3) return 2;
  stk::Stk::setSampleRate(48000);
  std::vector<stk::BiQuad> filters;
  std::vector<double> gains;
  double frequency_hz = 0, t60_s = 0, gain = 0;
  while (std::scanf("%lf %lf %lf", &frequency_hz, &t60_s, &gain) == 3) {
    filters.emplace_back();
    filters.back().setResonance(frequency_hz, std::exp(std::log(0.001) / (t60_s * 48000)), false);
    gains.push_back(gain);
  }
  const auto frame_count = static_cast<long>(std::atof(values[2]) * 48000);
  double sum = 0;
  for (long n = 0; n < frame_count; ++n) {
    const double input = n == 0 ? 1 : 0;
    for (std::size_t m = 0; m < filters.size(); ++m) sum += gains[m] * filters[m].tick(input);
  }
  std::printf("%g\n", sum);
}
