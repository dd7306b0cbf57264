// SPDX-License-Identifier: Apache-2.0
// How many modes one core renders in real time: ringing freely, and struck in every block.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/benchmarks/mixer/programs.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

constexpr uint32_t kModesABank = 800;
constexpr size_t kBlock = 128;
constexpr double kBlockS = kBlock / kTestSampleRateHz;

/// A mixer with banks whose modes are never put to sleep, so that all are rendered in every block,
/// as other synthesizers do.
class Stage {
 public:
  explicit Stage(size_t mode_count) : mixer_({.most_banks = mode_count / kModesABank}) {
    const ShapeTable shapes = MakeUniformShapes(kModesABank, 1e-4F);
    for (size_t i = 0; i < mode_count / kModesABank; ++i) {
      banks_.push_back(
          mixer_
              .Add(std::make_unique<OscillatorBank>(DrawModes(kModesABank, i), shapes,
                                                    OscillatorBankSettings{.silence = 0}))
              .value());
    }
  }

  void Strike(size_t bank, uint64_t offset, Pulse pulse = {}) {
    SurfaceImpulse impulse = MakeUnitImpulse();
    impulse.pulse = pulse;
    stream_->TryPush({.bank = banks_[bank % banks_.size()],
                      .frame = mixer_.frame() + offset,
                      .fraction = 0.5F,
                      .action = impulse});
  }

  /// CPU seconds of one block.
  double Render() {
    const double begin = ThreadSeconds();
    mixer_.Render(block_);
    return ThreadSeconds() - begin;
  }

  size_t bank_count() const { return banks_.size(); }
  uint64_t active_mode_count() const { return mixer_.statistics().active_mode_count; }

 private:
  Mixer mixer_;
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(65536).value();
  std::vector<BankId> banks_;
  std::vector<float> block_ = std::vector<float>(kBlock);
};

void Report(const Stage& stage, const std::vector<double>& block_s) {
  double sum = 0;
  for (const double s : block_s) sum += s;
  const double load = sum / static_cast<double>(block_s.size()) / kBlockS;
  const auto modes = static_cast<double>(stage.active_mode_count());
  std::printf("{\"modes\": %.0f, \"load\": %.4f, \"modes_per_core\": %.0f}\n", modes, load,
              modes / load);
  std::fflush(stdout);
}

/// Small scenes are rendered longer, so that every measurement takes about the same CPU time.
double LengthS(size_t mode_count, double seconds) {
  constexpr double kLargeScene = 80'000;
  return seconds * std::max(kLargeScene / static_cast<double>(mode_count), 1.0);
}

/// Strikes every bank once a second, one after the other, so that the banks ring by spectrum.
void MeasureRinging(size_t mode_count, double seconds) {
  Stage stage(mode_count);
  seconds = LengthS(mode_count, seconds);
  for (size_t bank = 0; bank < stage.bank_count(); ++bank) {
    stage.Strike(bank, bank % kBlock);
    if (bank % 8 == 7) stage.Render();
  }
  for (int block = 0; block < 16; ++block) stage.Render();
  std::vector<double> block_s;
  double due = 0;
  size_t struck = 0;
  for (double time_s = 0; time_s < seconds; time_s += kBlockS) {
    for (due += kBlockS * static_cast<double>(stage.bank_count()); due >= 1; --due, ++struck) {
      stage.Strike(struck, struck * 37 % kBlock);
    }
    block_s.push_back(stage.Render());
  }
  Report(stage, block_s);
}

/// Strikes every bank in every block, between two samples.
void MeasureStruck(size_t mode_count, double seconds, Pulse pulse) {
  Stage stage(mode_count);
  seconds = LengthS(mode_count, seconds);
  std::vector<double> block_s;
  const int warm_up = 64;  // until all banks have left the spectrum
  for (int block = 0; block < warm_up + seconds / kBlockS; ++block) {
    for (size_t bank = 0; bank < stage.bank_count(); ++bank) {
      stage.Strike(bank, (bank * 37 + static_cast<size_t>(block) * 11) % kBlock, pulse);
    }
    const double s = stage.Render();
    if (block >= warm_up) block_s.push_back(s);
  }
  Report(stage, block_s);
}

}  // namespace

int MeasureRinging(const Arguments& arguments) {
  const double seconds = arguments.empty() ? 3 : std::atof(arguments[0].c_str());
  for (const size_t modes : {800'000U, 8'000U, 80'000U}) MeasureRinging(modes, seconds);
  return EXIT_SUCCESS;
}

int MeasureStruck(const Arguments& arguments) {
  const double seconds = arguments.empty() ? 3 : std::atof(arguments[0].c_str());
  for (const size_t modes : {800U, 8'000U, 80'000U}) {
    MeasureStruck(modes, seconds, {});
    MeasureStruck(modes, seconds, Pulse::RaisedCosine(1e-4F));
    MeasureStruck(modes, seconds, Pulse::RaisedCosine(4e-4F));
    MeasureStruck(modes, seconds, Pulse::Gaussian(1e-4F));
  }
  return EXIT_SUCCESS;
}

int PrintPopulation(const Arguments&) {
  for (const SoundingMode& mode : DrawModes(kModesABank, 1).modes) {
    std::printf("%.17g %.17g %.17g\n", mode.natural_frequency_hz,
                -std::log(1000.0) / mode.decay_rate_per_s, mode.coupling);
  }
  return EXIT_SUCCESS;
}

}  // namespace carillon
