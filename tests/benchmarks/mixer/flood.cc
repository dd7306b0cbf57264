// SPDX-License-Identifier: Apache-2.0
// A flood of impulses on twenty ringing bodies, in real time: what is exact, merged and shed, and
// whether any deadline is missed.
#include <pthread.h>
#include <sched.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "server/base/clock.h"
#include "server/synthesis/mixer.h"
#include "tests/benchmarks/mixer/programs.h"
#include "tests/server/synthesis/closed_form.h"

namespace carillon {
namespace {

using std::chrono::nanoseconds;
constexpr size_t kBodies = 20, kVertices = 10'000, kFloodModes = 800, kStreams = 4,
                 kFloodBlock = 128;
constexpr double kFloodBlockS = kFloodBlock / kTestSampleRateHz;
/// The daemon's default.
constexpr size_t kLookAheadBlocks = 8;
constexpr double kGoldenAngle = 2.399963229728653;

/// Points evenly on a unit sphere; i, i + 89 and i + 144 are neighbours.
std::array<double, 3> VertexAt(size_t i) {
  const double z = 1 - (2 * static_cast<double>(i) + 1) / kVertices;
  const double angle = kGoldenAngle * static_cast<double>(i), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Smooth shapes: standing waves whose length shrinks as that of a body's modes does, mode m with
/// about sqrt(m) half waves around the body.
ShapeTable MakeWaves(uint64_t body) {
  std::mt19937 random(static_cast<uint32_t>(body));
  std::normal_distribution<float> normal;
  std::vector<float> values(3 * kVertices * kFloodModes);
  std::vector<std::array<float, 7>> waves(kFloodModes);
  for (size_t m = 0; m < kFloodModes; ++m) {
    for (float& x : waves[m]) x = normal(random);
    const float length = std::hypot(waves[m][0], waves[m][1], waves[m][2]);
    for (size_t i = 0; i < 3; ++i) waves[m][i] *= std::sqrt(static_cast<float>(m) + 1) / length;
  }
  for (size_t v = 0; v < kVertices; ++v) {
    const auto at = VertexAt(v);
    for (size_t m = 0; m < kFloodModes; ++m) {
      const auto& w = waves[m];
      const float wave =
          std::sin(w[0] * static_cast<float>(at[0]) + w[1] * static_cast<float>(at[1]) +
                   w[2] * static_cast<float>(at[2]) + w[6]);
      for (size_t axis = 0; axis < 3; ++axis) {
        values[(3 * v + axis) * kFloodModes + m] = wave * w[3 + axis];
      }
    }
  }
  return MakeShapes(values, kFloodModes);
}

SoundingModes MakeBodyModes(uint64_t body) {
  std::mt19937 random(static_cast<uint32_t>(body) + 1000);
  std::uniform_real_distribution<double> uniform;
  SoundingModes sounding;
  for (uint32_t m = 0; m < kFloodModes; ++m) {
    const double frequency_hz = 150 + 22.0 * m + 15 * uniform(random);
    const double t60_s = 0.3 * std::pow(10.0, uniform(random));
    sounding.modes.push_back(MakeMode(m, frequency_hz, -std::log(1000.0) / t60_s, 1e-3));
  }
  return sounding;
}

/// Impulses whose sizes spread over 60 dB, as in a pile of debris.
class Impulses {
 public:
  explicit Impulses(uint32_t seed) : random_(seed) {
    std::uniform_real_distribution<float> uniform;
    for (MixerEvent& event : events_) {
      const auto v = static_cast<uint32_t>(random_() % (kVertices - 144));
      const float a = std::sqrt(uniform(random_)), b = uniform(random_);
      SurfaceImpulse impulse{
          .at = {.vertices = {v, v + 89, v + 144}, .weights = {1 - a, a * (1 - b), a * b}}};
      const float size = 1e-3F * std::pow(10.0F, -3 * uniform(random_));
      for (float& x : impulse.impulse_newton_seconds) x = size * (2 * uniform(random_) - 1);
      event.action = impulse;
      event.fraction = uniform(random_);
    }
  }

  MixerEvent Next() {
    MixerEvent event = events_[next_++ % events_.size()];
    event.frame = random_() % kFloodBlock;
    body_ = random_() % kBodies;
    return event;
  }
  size_t body() const { return body_; }

 private:
  std::mt19937 random_;
  std::vector<MixerEvent> events_ = std::vector<MixerEvent>(1 << 16);
  size_t next_ = 0, body_ = 0;
};

struct Bodies {
  std::vector<SoundingModes> modes;
  std::vector<ShapeTable> shapes;
  Bodies() {
    for (size_t body = 0; body < kBodies; ++body) {
      modes.push_back(MakeBodyModes(body));
      shapes.push_back(MakeWaves(body));
    }
  }
};

/// Pushes `rate` impulses a second onto four streams until `done`.
void Flood(Mixer& mixer, const std::vector<BankId>& banks, double rate,
           const std::atomic<bool>& done) {
  std::vector<std::unique_ptr<EventStream>> streams;
  for (size_t i = 0; i < kStreams; ++i) streams.push_back(mixer.OpenStream(1 << 17).value());
  Impulses impulses(7);
  uint64_t block = mixer.frame() / kFloodBlock;
  double due = 0;
  for (; !done; std::this_thread::sleep_for(std::chrono::microseconds(300))) {
    // The impulses of a block are pushed two blocks ahead of it.
    for (; block <= mixer.frame() / kFloodBlock + 2; ++block) {
      for (due += rate * kFloodBlockS; due >= 1; --due) {
        MixerEvent event = impulses.Next();
        event.bank = banks[impulses.body()];
        event.frame += block * kFloodBlock;
        streams[static_cast<size_t>(due) % kStreams]->TryPush(event);
      }
    }
  }
}

void MakeThisThreadRealtime() {
  const sched_param priority{.sched_priority = 20};
  if (pthread_setschedparam(pthread_self(), SCHED_FIFO, &priority) != 0) {
    std::fputs("the thread that renders has no real-time priority\n", stderr);
  }
}

struct Result {
  std::vector<double> block_s, cpu_s;
  uint64_t late_block_count = 0;  // finished after the next block was due
  uint64_t missed_count = 0;      // finished later than the daemon's look-ahead allows
};

/// Renders blocks for a simulated device that takes 128 frames every 2.67 ms.
Result RenderInTime(Mixer& mixer, const Clock& clock, double seconds) {
  Result result;
  MakeThisThreadRealtime();
  std::vector<float> block(kFloodBlock);
  const auto block_count = static_cast<size_t>(seconds / kFloodBlockS);
  const nanoseconds start = clock.Monotonic();
  const auto due = [start](size_t i) {
    return start + nanoseconds(int64_t(1e9 * kFloodBlockS * double(i)));
  };
  for (size_t i = 0; i < block_count; ++i) {
    while (clock.Monotonic() < due(i)) std::this_thread::sleep_for(due(i) - clock.Monotonic());
    const double cpu = ThreadSeconds();
    const nanoseconds begin = clock.Monotonic();
    mixer.Render(block);
    const nanoseconds end = clock.Monotonic();
    result.cpu_s.push_back(ThreadSeconds() - cpu);
    result.block_s.push_back(1e-9 * static_cast<double>((end - begin).count()));
    result.late_block_count += end > due(i + 1) ? 1 : 0;
    result.missed_count += end > due(i + 1 + kLookAheadBlocks) ? 1 : 0;
  }
  return result;
}

void MeasureRate(const Bodies& bodies, double rate, double seconds) {
  SystemClock clock;
  Mixer mixer({.most_banks = kBodies, .clock = &clock});
  std::vector<BankId> banks;
  for (size_t body = 0; body < kBodies; ++body) {
    banks.push_back(mixer
                        .Add(std::make_unique<OscillatorBank>(
                            bodies.modes[body], bodies.shapes[body], OscillatorBankSettings{}))
                        .value());
  }
  std::atomic<bool> done{false};
  std::thread client([&] { Flood(mixer, banks, rate, done); });
  Result result;
  std::thread render([&] { result = RenderInTime(mixer, clock, seconds); });
  render.join();
  done = true;
  client.join();
  const MixerStatistics s = mixer.statistics();
  double load = 0;
  for (const double cpu : result.cpu_s) load += cpu / kFloodBlockS;
  const auto per_s = [seconds](uint64_t count) { return static_cast<double>(count) / seconds; };
  std::printf(
      "{\"rate\": %.0f, \"taken_per_s\": %.0f, \"merged_per_s\": %.0f, \"shed_per_s\": %.0f, "
      "\"dropped\": %llu, \"load\": %.3f, \"median_block_ms\": %.3f, \"worst_block_ms\": %.3f, "
      "\"late_blocks\": %llu, \"missed\": %llu}\n",
      rate, per_s(s.accepted_count + s.late_count), per_s(s.merged_count), per_s(s.shed_count),
      static_cast<unsigned long long>(s.dropped_count),
      load / static_cast<double>(result.cpu_s.size()), 1e3 * Quantile(result.block_s, 0.5),
      1e3 * Quantile(result.block_s, 1), static_cast<unsigned long long>(result.late_block_count),
      static_cast<unsigned long long>(result.missed_count));
  std::fflush(stdout);
}

}  // namespace

int MeasureFlood(const Arguments& arguments) {
  const double seconds = arguments.empty() ? 60 : std::atof(arguments[0].c_str());
  const Bodies bodies;
  for (const double rate : {3e5, 1e6, 1e7}) MeasureRate(bodies, rate, seconds);
  return EXIT_SUCCESS;
}

}  // namespace carillon
