// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

/// A bank of 800 modes that ring for an hour.
std::unique_ptr<OscillatorBank> MakeLastingBank() {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 800; ++m) sounding.modes.push_back(MakeMode(m, 24 * (m + 1), -1e-3));
  return std::make_unique<OscillatorBank>(sounding, MakeUniformShapes(800, 100),
                                          OscillatorBankSettings{});
}

/// Blocks of 128 frames of so many ringing modes; modes_per_core is what one core renders in real
/// time.
void Ringing(benchmark::State& state) {
  Mixer mixer;
  const auto stream = mixer.OpenStream().value();
  std::vector<float> block(128);
  for (int64_t modes = 0; modes < state.range(0); modes += 800) {
    const BankId id = mixer.Add(MakeLastingBank()).value();
    stream->TryPush({.bank = id, .action = MakeUnitImpulse()});
    if (modes % 8000 == 0) mixer.Render(block);
  }
  mixer.Render(block);
  for (auto _ : state) mixer.Render(block);
  const double active = static_cast<double>(mixer.statistics().active_mode_count);
  state.counters["modes_per_core"] =
      benchmark::Counter(active * 128 / kTestSampleRateHz * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate);
  state.SetLabel(std::string(SimdTarget()));
}
BENCHMARK(Ringing)->Arg(800)->Arg(8000)->Arg(80000)->Arg(800000);

/// Blocks in which so many strikes arrive at a bank of 800 modes, each between two samples.
void StrikeBlocks(benchmark::State& state) {
  SoundingModes sounding;
  for (uint32_t m = 0; m < 800; ++m) sounding.modes.push_back(MakeMode(m, 24 * (m + 1), -5));
  Mixer mixer;
  const BankId id = mixer
                        .Add(std::make_unique<OscillatorBank>(sounding, MakeUniformShapes(800),
                                                              OscillatorBankSettings{}))
                        .value();
  const auto stream = mixer.OpenStream().value();
  std::vector<float> block(128);
  for (auto _ : state) {
    for (int64_t i = 0; i < state.range(0); ++i) {
      stream->TryPush({.bank = id,
                       .frame = mixer.frame() + static_cast<uint64_t>(i) % 128,
                       .fraction = 0.5F,
                       .action = MakeUnitImpulse()});
    }
    mixer.Render(block);
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(StrikeBlocks)->Arg(0)->Arg(1)->Arg(16)->Arg(256);

}  // namespace
}  // namespace carillon

BENCHMARK_MAIN();
