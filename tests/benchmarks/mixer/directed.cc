// SPDX-License-Identifier: Apache-2.0
// What it costs that objects have a place, that two ears hear them, and that their modes have
// directions.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "server/synthesis/mixer.h"
#include "tests/benchmarks/mixer/programs.h"
#include "tests/server/synthesis/closed_form.h"
#include "tests/server/synthesis/voice/sphere_head.h"

namespace carillon {
namespace {

constexpr size_t kPlacedBlock = 128;
constexpr double kPlacedBlockS = kPlacedBlock / kTestSampleRateHz;
constexpr double kBodyRadiusM = 0.1;

struct DrawnPatterns {
  std::vector<uint32_t> first{0}, harmonics;
  std::vector<float> re, im;
};

/// Patterns of the order that bodies of this radius need (0.75 k a + 2, at most `most_order`), each
/// harmonic with a share of two thirds.
Directivity DrawDirectivity(const SoundingModes& sounding, uint32_t most_order) {
  std::mt19937_64 random(1);
  const auto arrays = std::make_shared<DrawnPatterns>();
  for (const SoundingMode& mode : sounding.modes) {
    const double ka = 2 * std::numbers::pi * mode.natural_frequency_hz / 343 * kBodyRadiusM;
    const uint32_t order = std::min(static_cast<uint32_t>(0.75 * ka + 2), most_order);
    for (uint32_t i = 0; i < (order + 1) * (order + 1); ++i) {
      if (random() % 3 == 0) continue;
      arrays->harmonics.push_back(i);
      arrays->re.push_back(0.7F / static_cast<float>(order + 1));
      arrays->im.push_back((random() % 2 == 0 ? 0.7F : -0.7F) / static_cast<float>(order + 1));
    }
    arrays->first.push_back(static_cast<uint32_t>(arrays->harmonics.size()));
  }
  return {.first = arrays->first,
          .harmonics = arrays->harmonics,
          .pattern_re = arrays->re,
          .pattern_im = arrays->im,
          .radius_m = kBodyRadiusM,
          .owner = arrays};
}

/// What is measured.
struct PlacedSetting {
  std::string name;
  bool placed = true;
  bool moving = false;
  uint32_t most_order = 0;  ///< zero: without directivity
  bool near_field = false;
  bool binaural = false;
};

/// Objects whose modes are never put to sleep, heard by one listener.
class PlacedStage {
 public:
  PlacedStage(const PlacedSetting& setting, size_t object_count, uint32_t mode_count)
      : setting_(setting), harmonic_count_(0) {
    const ShapeTable shapes = MakeUniformShapes(mode_count, 1e-4F);
    for (size_t i = 0; i < object_count; ++i) {
      const SoundingModes sounding = DrawModes(mode_count, i);
      OscillatorBankSettings settings{.silence = 0};
      if (setting.most_order > 0) {
        settings.directivity = {.directivity = DrawDirectivity(sounding, setting.most_order),
                                .near_field = setting.near_field};
        harmonic_count_ += settings.directivity->directivity.harmonics.size();
      }
      banks_.push_back(
          mixer_.Add(std::make_unique<OscillatorBank>(sounding, shapes, settings), MakeVoice(i))
              .value());
    }
  }

  void Strike(size_t bank) {
    stream_->TryPush({.bank = banks_[bank % banks_.size()],
                      .frame = mixer_.frame() + 40,
                      .action = MakeUnitImpulse()});
  }

  /// The listener walks round, at 1.5 radians a second, a step each 1/60 s.
  void Walk() {
    angle_ += 0.025F;
    const Motion motion{.position_m = {2 * std::cos(angle_), 2 * std::sin(angle_), 0.5F},
                        .glide_frames = 800};
    for (const BankId bank : banks_) {
      stream_->TryPush({.bank = bank, .frame = mixer_.frame(), .action = ListenerMove{motion}});
    }
  }

  /// CPU seconds of one block.
  double Render() {
    frames_until_walk_ -= kPlacedBlock;
    if (setting_.moving && frames_until_walk_ < 0) {
      frames_until_walk_ += 800;
      Walk();
    }
    const double begin = ThreadSeconds();
    mixer_.Render(block_);
    return ThreadSeconds() - begin;
  }

  size_t bank_count() const { return banks_.size(); }
  size_t harmonic_count() const { return harmonic_count_; }

 private:
  std::shared_ptr<Voice> MakeVoice(size_t object) const {
    if (!setting_.placed) return nullptr;
    const HearingSettings hearing{.distance_gain = true,
                                  .propagation_delay = true,
                                  .panning = !setting_.binaural,
                                  .binaural = setting_.binaural,
                                  .directivity = setting_.most_order > 0,
                                  .near_field = setting_.near_field};
    static const auto head = std::make_shared<const Head>(SphereHead::Make());
    return std::make_shared<Voice>(
        Voice::Settings{
            .hearing = hearing, .channel_count = 2, .head = setting_.binaural ? head : nullptr},
        Place{.position_m = {0.1 * static_cast<double>(object), 0, 0}},
        Place{.position_m = {2, 0, 0.5}});
  }

  PlacedSetting setting_;
  size_t harmonic_count_;
  Mixer mixer_{MixerSettings{.channel_count = 2}};
  std::unique_ptr<EventStream> stream_ = mixer_.OpenStream(65536).value();
  std::vector<BankId> banks_;
  std::vector<float> block_ = std::vector<float>(2 * kPlacedBlock);
  float angle_ = 0;
  double frames_until_walk_ = 0;
};

void MeasurePlaced(const PlacedSetting& setting, size_t object_count, uint32_t mode_count,
                   double seconds) {
  PlacedStage stage(setting, object_count, mode_count);
  for (size_t bank = 0; bank < stage.bank_count(); ++bank) stage.Strike(bank);
  for (int block = 0; block < 64; ++block) stage.Render();
  std::vector<double> block_s;
  for (double time_s = 0; time_s < seconds; time_s += kPlacedBlockS) {
    const auto before =
        static_cast<size_t>((time_s - kPlacedBlockS) * static_cast<double>(object_count));
    const auto due = static_cast<size_t>(time_s * static_cast<double>(object_count));
    if (due > before) stage.Strike(due);
    block_s.push_back(stage.Render());
  }
  std::printf(
      "{\"what\": \"%s\", \"target\": \"%s\", \"objects\": %zu, \"modes\": %u, "
      "\"harmonics\": %zu, \"load\": %.5f, \"p99_block_ms\": %.4f}\n",
      setting.name.c_str(), std::string(SimdTarget()).c_str(), object_count, mode_count,
      stage.harmonic_count(), Quantile(block_s, 0.5) / kPlacedBlockS,
      1e3 * Quantile(block_s, 0.99));
  std::fflush(stdout);
}

}  // namespace

int MeasureDirected(const Arguments& arguments) {
  const double seconds = arguments.empty() ? 10 : std::atof(arguments[0].c_str());
  const auto measure = [seconds](const PlacedSetting& setting) {
    MeasurePlaced(setting, 1, 800, 4 * seconds);
    MeasurePlaced(setting, 20, 200, seconds);
  };
  measure({.name = "no place", .placed = false});
  for (PlacedSetting setting : {PlacedSetting{.name = "place"},
                                {.name = "two ears", .binaural = true},
                                {.name = "directions of order 2", .most_order = 2},
                                {.name = "directions to order 29", .most_order = 36}}) {
    const std::string name = setting.name;
    measure(setting);
    setting.moving = true;
    setting.name = name + ", moving";
    measure(setting);
    if (setting.most_order == 0) continue;
    setting.near_field = true;
    setting.name = name + ", near, moving";
    measure(setting);
  }
  return EXIT_SUCCESS;
}

}  // namespace carillon
