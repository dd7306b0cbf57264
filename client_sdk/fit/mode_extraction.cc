// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/mode_extraction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "client_sdk/fit/band_signal.h"
#include "client_sdk/fit/esprit.h"
#include "client_sdk/fit/room_decay.h"
#include "client_sdk/fit/statistics.h"

namespace carillon::fit {
namespace {

constexpr double kLowest_hz = 40, kHighest_hz = 22'000;
constexpr double kHighestOfRate = 0.46;
constexpr int kMostOrder = 18, kMostHeight = 160, kLeastHeight = 10;
/// Where windows begin after the blow, s: after the contact, and after the blur of the filter. Each
/// is taken whole and by its first half.
constexpr std::array<double, 3> kStarts_s = {0.006, 0.010, 0.0175};
constexpr std::array<double, 2> kLengths = {1, 0.5};
constexpr size_t kRuns = kMostOrder * kStarts_s.size() * kLengths.size();
constexpr double kLeastStable = 0.4;
/// A window ends where the power is within 5 dB of the noise, or 45 dB below its greatest.
constexpr double kOverNoise = 3.2, kBelowPeak = 3.2e-5;
constexpr double kLongest_s = 2.5, kShortest_s = 0.03;
/// A band with less power than this over the noise has no modes.
constexpr double kLeastOverNoise = 10;
constexpr double kMostDecay_per_s = 700;
/// Energy of a mode over that of the noise that fits into its window, and over that of the band.
constexpr double kLeastModeOverNoise = 30, kLeastOfBand = 1e-5;
/// Lines this near to a stronger one are the room's, unless they are sharp.
constexpr double kSwarm = 0.008;
constexpr double kSharp = 2e-4, kSharpDecay = 0.2;
constexpr double kHum_per_s = 0.03;
/// The part of a ring whose noise is compared with that before the blow, and the least fall of the
/// noise, and number of bands with noise, that count.
constexpr double kNoiseFrom_s = 0.1, kNoiseTo_s = 0.5, kLeastFall_db = 3;
/// The quietest parts of even noise differ by less, dB.
constexpr double kLeastGateFall_db = 12;
constexpr size_t kLeastNoisy = 10;
/// Decays this near to the room's are hard to tell from it.
constexpr double kNearRoom = 0.3;
/// The least relative error of a decay in a room, and that of one as fast as the room's, which
/// grows with the ratio of both: so they were in simulated rooms, up to three times the room's
/// rate. Of a mode that dies much sooner than the room only the room is left where the window
/// begins.
constexpr double kLeastErrorInRoom = 0.015, kErrorAtRoom = 0.15;

/// A pole of one run, in Hz and 1/s.
struct Pole {
  double frequency_hz;
  double decay_per_s;
  size_t run;
};

/// One ring in one band.
struct BandRing {
  size_t ring;
  std::vector<std::complex<double>> samples;  ///< from the onset on, to the end of the window
  double noise;                               ///< mean |x|^2 of the noise
  double rate_hz;
};

/// Returns the mean |x|^2 of the noise, from the median of the periodogram, which lines that ring
/// do not raise.
double MedianNoise(Signal x) {
  if (x.size() < 16) return std::numeric_limits<double>::infinity();
  // Hann's window keeps strong lines from leaking over the band.
  std::vector<double> powers;
  const size_t n = x.size();
  for (size_t bin = 0; bin < n; ++bin) {
    const double hz = static_cast<double>(bin) / static_cast<double>(n);
    if (std::min(hz, 1 - hz) > kHalfBand_hz / kBandRate_hz) continue;
    std::complex<double> sum = 0;
    for (size_t i = 0; i < n; ++i) {
      const double phase =
          2 * std::numbers::pi * static_cast<double>(bin * i % n) / static_cast<double>(n);
      const double hann = 1 - std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) /
                                       static_cast<double>(n));
      sum += hann * x[i] * std::polar(1.0, -phase);
    }
    powers.push_back(std::norm(sum) / (1.5 * static_cast<double>(n)));
  }
  // The band holds its noise within its own width, of which the flanks have some part.
  return Median(powers) / std::numbers::ln2 * (2 * kHalfBand_hz + 140) / kBandRate_hz;
}

/// Finds the modes of one band.
class Band {
 public:
  Band(const std::vector<Ring>& rings, const std::vector<BandSignals>& signals, double centre_hz)
      : centre_hz_(centre_hz), ring_count_(rings.size()) {
    for (size_t r = 0; r < rings.size(); ++r) {
      if (centre_hz > kHighestOfRate * rings[r].sample_rate_hz) continue;
      double centre = centre_hz;
      const std::vector<std::complex<double>> all = signals[r].Cut(centre);
      const double rate = signals[r].rate_hz();
      const auto onset =
          static_cast<size_t>(static_cast<double>(rings[r].onset) / rings[r].sample_rate_hz * rate);
      Add(r, all, onset, rate);
      // Rings of different lengths have centres that differ by less than their resolution.
      Turn(centre - centre_hz);
    }
  }

  std::vector<MeasuredMode> Modes() const {
    std::vector<MeasuredMode> modes;
    if (rings_.empty()) return modes;
    std::vector<Pole> poles = AllPoles();
    while (true) {
      MeasuredMode mode;
      if (!TakeMostStable(poles, mode)) break;
      // Neighbouring bands overlap a little, so that a line between them is in one at least.
      if (std::abs(mode.frequency_hz - centre_hz_) <= kHalfBand_hz + 5) modes.push_back(mode);
    }
    if (!modes.empty()) Measure(modes);
    return modes;
  }

  /// The rings, and those of all modes that lie in the band.
  BandRings RingsOf(const std::vector<MeasuredMode>& all) const {
    BandRings band;
    for (const BandRing& ring : rings_)
      band.rings.push_back({ring.samples, ring.rate_hz, ring.noise});
    for (size_t m = 0; m < all.size(); ++m) {
      const double hz = all[m].frequency_hz - centre_hz_;
      if (hz < -kHalfBand_hz || hz >= kHalfBand_hz) continue;
      band.modes.push_back({.frequency_hz = hz, .decay_per_s = all[m].decay_per_s, .index = m});
    }
    return band;
  }

  double centre_hz() const { return centre_hz_; }

  /// By how much the noise falls at the blow of each ring that has noise before it, dB.
  const std::vector<double>& noise_falls_db() const { return noise_falls_db_; }

 private:
  void Add(size_t ring, const std::vector<std::complex<double>>& all, size_t onset, double rate) {
    const auto index = [&](double seconds) { return static_cast<size_t>(seconds * rate); };
    if (all.size() < onset + index(kShortest_s)) return;
    const Signal signal(all);
    const size_t tail = (all.size() - onset) / 3;
    double noise = MedianNoise(signal.last(std::min(tail, size_t{200})));
    if (onset > index(0.08)) {
      const double before = MedianNoise(signal.subspan(index(0.01), onset - index(0.025)));
      noise = std::min(noise, before);
      if (before > 0 && all.size() > onset + index(kNoiseTo_s)) {
        const size_t from = onset + index(kNoiseFrom_s), to = onset + index(kNoiseTo_s);
        const double after = MedianNoise(signal.subspan(from, to - from));
        noise_falls_db_.push_back(10 * std::log10(before / (after + 1e-300)));
      }
    }
    std::vector<double> power(all.size());
    const size_t half = index(0.005);
    for (size_t i = onset; i < all.size(); ++i) {
      const size_t from = std::max(onset, i - std::min(i, half)),
                   to = std::min(all.size(), i + half + 1);
      for (size_t j = from; j < to; ++j)
        power[i] += std::norm(all[j]) / static_cast<double>(to - from);
    }
    const size_t soon = std::min(all.size(), onset + index(0.1));
    const auto peak = std::max_element(power.begin() + static_cast<std::ptrdiff_t>(onset),
                                       power.begin() + static_cast<std::ptrdiff_t>(soon));
    if (*peak < kLeastOverNoise * noise || *peak == 0) return;
    const double least = std::max(kOverNoise * noise, kBelowPeak * *peak);
    auto end = static_cast<size_t>(peak - power.begin());
    while (end < all.size() && power[end] > least && end < onset + index(kLongest_s)) ++end;
    // The filter blurs the end of the recording, too.
    end = std::min(end, all.size() - index(0.01));
    if (end < onset + index(kShortest_s)) return;
    rings_.push_back({.ring = ring,
                      .samples = {all.begin() + static_cast<std::ptrdiff_t>(onset),
                                  all.begin() + static_cast<std::ptrdiff_t>(end)},
                      .noise = noise,
                      .rate_hz = rate});
    added_ = true;
  }

  /// Turns the ring that was just added by a difference of centres.
  void Turn(double hz) {
    if (!added_) return;
    added_ = false;
    BandRing& ring = rings_.back();
    for (size_t n = 0; n < ring.samples.size(); ++n) {
      ring.samples[n] *=
          std::polar(1.0, 2 * std::numbers::pi * hz * static_cast<double>(n) / ring.rate_hz);
    }
  }

  /// The windows of all rings for one run, scaled so that their noises are equal; a strong ring has
  /// deviations of its own, from its room and its hammer.
  std::vector<std::vector<std::complex<double>>> Windows(double start_s, double length) const {
    std::vector<std::vector<std::complex<double>>> windows;
    for (const BandRing& ring : rings_) {
      const auto start = static_cast<size_t>(start_s * ring.rate_hz);
      if (ring.samples.size() <= start + kLeastHeight) continue;
      const auto count =
          static_cast<size_t>(length * static_cast<double>(ring.samples.size() - start));
      const Signal part = Signal(ring.samples).subspan(start, count);
      double energy = 0;
      for (const auto& x : part) energy += std::norm(x);
      const double scale =
          1 / std::sqrt(ring.noise + 1e-3 * energy / static_cast<double>(count) + 1e-300);
      windows.emplace_back(part.begin(), part.end());
      for (auto& x : windows.back()) x *= scale;
    }
    return windows;
  }

  std::vector<Pole> AllPoles() const {
    std::vector<Pole> found;
    size_t run = 0;
    for (const double start : kStarts_s) {
      for (const double length : kLengths) {
        const auto windows = Windows(start, length);
        size_t longest = 0;
        for (const auto& window : windows) longest = std::max(longest, window.size());
        const int height = std::min(kMostHeight, static_cast<int>(longest * 2 / 5));
        if (height < kLeastHeight) {
          run += kMostOrder;
          continue;
        }
        for (const auto& poles :
             EspritPoles({windows.begin(), windows.end()}, height, kMostOrder)) {
          for (const std::complex<double>& z : poles) AddPole(z, run, found);
          ++run;
        }
      }
    }
    std::ranges::sort(found, {}, &Pole::frequency_hz);
    return found;
  }

  void AddPole(const std::complex<double>& z, size_t run, std::vector<Pole>& found) const {
    if (std::abs(z) < 1e-6) return;
    const std::complex<double> exponent = std::log(z) * rings_[0].rate_hz;
    const Pole pole{.frequency_hz = centre_hz_ + exponent.imag() / (2 * std::numbers::pi),
                    .decay_per_s = -exponent.real(),
                    .run = run};
    if (pole.decay_per_s < -2 || pole.decay_per_s > kMostDecay_per_s) return;
    if (std::abs(pole.frequency_hz - centre_hz_) > kHalfBand_hz + 60) return;
    found.push_back(pole);
  }

  static double FrequencyTolerance(const Pole& pole) {
    return std::max(0.5, 0.04 * std::abs(pole.decay_per_s));
  }

  /// Calls `use` with the index of the nearest pole of each run to `poles[at]`.
  template <typename Use>
  static void ForEachNear(const std::vector<Pole>& poles, size_t at, Use use) {
    const Pole& centre = poles[at];
    const double hz = FrequencyTolerance(centre), per_s = std::max(1.0, 0.3 * centre.decay_per_s);
    std::array<double, kRuns> distance;
    std::array<size_t, kRuns> nearest;
    distance.fill(1);
    const auto first =
        std::ranges::lower_bound(poles, centre.frequency_hz - hz, {}, &Pole::frequency_hz);
    for (auto pole = first; pole != poles.end() && pole->frequency_hz <= centre.frequency_hz + hz;
         ++pole) {
      const double d = std::hypot((pole->frequency_hz - centre.frequency_hz) / hz,
                                  (pole->decay_per_s - centre.decay_per_s) / per_s);
      if (d >= distance[pole->run]) continue;
      distance[pole->run] = d;
      nearest[pole->run] = static_cast<size_t>(pole - poles.begin());
    }
    for (size_t run = 0; run < kRuns; ++run) {
      if (distance[run] < 1) use(nearest[run]);
    }
  }

  /// Takes the poles of the mode that most runs have out of `poles`. Returns whether there is one.
  static bool TakeMostStable(std::vector<Pole>& poles, MeasuredMode& mode) {
    size_t best = 0, best_count = 0;
    for (size_t at = 0; at < poles.size(); ++at) {
      size_t count = 0;
      ForEachNear(poles, at, [&](size_t) { ++count; });
      if (count > best_count) best = at, best_count = count;
    }
    if (static_cast<double>(best_count) < kLeastStable * static_cast<double>(kRuns)) return false;
    std::vector<double> frequencies, decays;
    std::vector<size_t> members;
    ForEachNear(poles, best, [&](size_t at) {
      frequencies.push_back(poles[at].frequency_hz);
      decays.push_back(poles[at].decay_per_s);
      members.push_back(at);
    });
    mode.frequency_hz = Median(frequencies);
    mode.decay_per_s = Median(decays);
    mode.heard_hz = mode.frequency_hz;
    mode.heard_decay_per_s = mode.decay_per_s;
    mode.frequency_error_hz = std::max(1e-3, MedianDeviation(frequencies));
    mode.decay_error_per_s = std::max(1e-3, MedianDeviation(decays));
    // The other poles of the neighbourhood are the same mode, seen worse.
    const double hz = FrequencyTolerance(poles[best]) / 2;
    std::ranges::sort(members);
    std::vector<Pole> rest;
    for (size_t at = 0; at < poles.size(); ++at) {
      const bool taken = std::ranges::binary_search(members, at) ||
                         std::abs(poles[at].frequency_hz - mode.frequency_hz) < hz;
      if (!taken) rest.push_back(poles[at]);
    }
    poles = std::move(rest);
    return true;
  }

  /// Finds the amplitudes of the modes in each ring, and leaves out modes that do not stand out.
  void Measure(std::vector<MeasuredMode>& modes) const {
    std::vector<double> energy(modes.size()), over_noise(modes.size());
    for (MeasuredMode& mode : modes) mode.amplitudes.assign(ring_count_, 0);
    for (const BandRing& ring : rings_) {
      const auto start = static_cast<size_t>(kStarts_s[0] * ring.rate_hz);
      const Signal window = Signal(ring.samples).subspan(start);
      if (window.size() <= modes.size()) continue;
      std::vector<std::complex<double>> poles;
      poles.reserve(modes.size());
      for (const MeasuredMode& mode : modes) {
        poles.push_back(
            std::exp(std::complex<double>(-mode.decay_per_s,
                                          2 * std::numbers::pi * (mode.frequency_hz - centre_hz_)) /
                     ring.rate_hz));
      }
      const auto amplitudes = Amplitudes(window, poles);
      for (size_t m = 0; m < modes.size(); ++m) {
        const double decay = 2 * std::max(0.5, modes[m].decay_per_s) / ring.rate_hz;
        const double effective =
            (1 - std::exp(-decay * static_cast<double>(window.size()))) / decay;
        const double own = std::norm(amplitudes[m]) * effective;
        energy[m] += own;
        over_noise[m] += own / (ring.noise + 1e-300);
        modes[m].amplitudes[ring.ring] =
            amplitudes[m] / std::pow(poles[m], static_cast<double>(start));
      }
    }
    const double most = energy.empty() ? 0 : *std::ranges::max_element(energy);
    std::vector<MeasuredMode> kept;
    for (size_t m = 0; m < modes.size(); ++m) {
      if (over_noise[m] < kLeastModeOverNoise || energy[m] < kLeastOfBand * most) continue;
      modes[m].signal_to_noise_db = 10 * std::log10(over_noise[m]);
      kept.push_back(std::move(modes[m]));
    }
    modes = std::move(kept);
  }

  double centre_hz_;
  size_t ring_count_;
  bool added_ = false;
  std::vector<BandRing> rings_;
  std::vector<double> noise_falls_db_;
};

double Strength(const MeasuredMode& mode) {
  double strength = 0;
  for (const auto& a : mode.amplitudes) strength += std::norm(a);
  return strength;
}

bool IsSharp(const MeasuredMode& mode) {
  return mode.frequency_error_hz < kSharp * mode.frequency_hz &&
         mode.decay_error_per_s < std::max(0.3, kSharpDecay * mode.decay_per_s);
}

/// Energy for its uncertainty, by which lines near each other are compared.
double Worth(const MeasuredMode& mode) {
  const double error =
      mode.frequency_error_hz + mode.decay_error_per_s / (2 * std::numbers::pi) + 0.02;
  return Strength(mode) / std::max(0.5, mode.decay_per_s) / error;
}

/// Leaves out the lines by which a room surrounds a mode, and the copies of lines between two
/// bands.
std::vector<MeasuredMode> WithoutSwarms(std::vector<MeasuredMode> modes) {
  std::ranges::sort(modes, std::greater(), Worth);
  std::vector<MeasuredMode> kept;
  for (MeasuredMode& mode : modes) {
    size_t near = 0;
    bool same = false, sharp = IsSharp(mode);
    for (const MeasuredMode& other : kept) {
      const double apart_hz = std::abs(other.frequency_hz - mode.frequency_hz);
      // A sharp line in the flank of a band looks like a dull one beside it.
      same |= apart_hz < mode.decay_per_s / 2 && other.decay_per_s < mode.decay_per_s / 5;
      if (apart_hz > kSwarm * other.frequency_hz) continue;
      ++near;
      sharp &= IsSharp(other) && Strength(mode) > 1e-3 * Strength(other);
      same |= apart_hz < std::max(0.5, 0.04 * mode.decay_per_s);
    }
    if (!same && (near == 0 || (near == 1 && sharp))) kept.push_back(std::move(mode));
  }
  return kept;
}

/// Finds the room, and in it the decays anew.
void TellRoomApart(const std::vector<Band>& bands, const Progress& progress,
                   ExtractedModes& extracted) {
  std::vector<BandRings> all;
  size_t most_rings = 0;
  for (const Band& band : bands) {
    all.push_back(band.RingsOf(extracted.modes));
    most_rings = std::max(most_rings, all.back().rings.size());
  }
  // In one strike alone lines that beat are as likely as a room.
  if (most_rings < 2) return;
  extracted.room = FindRoom(all);
  if (extracted.room.share == 0) return;
  for (size_t b = 0; b < all.size(); ++b) {
    RefineInRoom(extracted.room, all[b]);
    for (const BandMode& refined : all[b].modes) {
      MeasuredMode& mode = extracted.modes[refined.index];
      // A room moves no line by its width: the likelihood has lost such a line, whose decay is then
      // as good as unknown.
      const double moved_hz = bands[b].centre_hz() + refined.frequency_hz - mode.frequency_hz;
      const double width_hz = mode.decay_per_s / std::numbers::pi;
      if (std::abs(moved_hz) > std::max(width_hz, 3 * mode.frequency_error_hz)) {
        mode.decay_error_per_s = mode.decay_per_s;
        continue;
      }
      mode.frequency_hz += moved_hz;
      mode.frequency_error_hz = std::hypot(mode.frequency_error_hz, moved_hz);
      mode.decay_per_s = refined.decay_per_s;
      const double ratio = refined.decay_per_s / extracted.room.decay_per_s;
      const double least = std::max(kLeastErrorInRoom, kErrorAtRoom * ratio);
      mode.decay_error_per_s = std::max(least * refined.decay_per_s, refined.decay_error_per_s);
      mode.near_room = std::abs(ratio - 1) < kNearRoom;
    }
    progress(0.6 + 0.4 * static_cast<double>(b + 1) / static_cast<double>(all.size()));
  }
}

/// Returns how far the noise falls at the blows in the middle of all bands: a voice or another
/// sound before a blow is in some of them.
double GainFallDb(const std::vector<Band>& bands) {
  std::vector<double> falls_db;
  for (const Band& band : bands) {
    falls_db.insert(falls_db.end(), band.noise_falls_db().begin(), band.noise_falls_db().end());
  }
  const double fall_db = Median(falls_db);
  return falls_db.size() < kLeastNoisy || fall_db < kLeastFall_db ? 0 : fall_db;
}

}  // namespace

ExtractedModes ExtractModes(const std::vector<Ring>& rings, const Progress& progress) {
  std::vector<BandSignals> signals;
  double highest = 0;
  for (const Ring& ring : rings) {
    signals.emplace_back(ring.samples, ring.sample_rate_hz);
    highest = std::max(highest, std::min(kHighest_hz, kHighestOfRate * ring.sample_rate_hz));
  }
  std::vector<Band> bands;
  std::vector<MeasuredMode> modes;
  for (double centre = kLowest_hz + kHalfBand_hz; centre - kHalfBand_hz < highest;
       centre += 2 * kHalfBand_hz) {
    bands.emplace_back(rings, signals, centre);
    for (MeasuredMode& mode : bands.back().Modes()) {
      const bool hums = mode.decay_per_s < kHum_per_s && mode.frequency_hz < 400;
      if (!hums && mode.frequency_hz <= highest) modes.push_back(std::move(mode));
    }
    progress(0.6 * std::min(1.0, centre / highest));
  }
  ExtractedModes extracted{.modes = WithoutSwarms(std::move(modes)), .room = {}};
  extracted.gain_fall_db = GainFallDb(bands);
  if (const double fall_db = GateFallDb(rings); fall_db > kLeastGateFall_db) {
    extracted.gain_fall_db = std::max(extracted.gain_fall_db, fall_db);
  }
  TellRoomApart(bands, progress, extracted);
  std::ranges::sort(extracted.modes, {}, &MeasuredMode::frequency_hz);
  double strongest = 0;
  for (const MeasuredMode& mode : extracted.modes) strongest = std::max(strongest, Strength(mode));
  for (MeasuredMode& mode : extracted.modes)
    mode.level_db = 10 * std::log10(Strength(mode) / strongest);
  return extracted;
}

}  // namespace carillon::fit
