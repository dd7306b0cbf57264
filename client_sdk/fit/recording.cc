// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/fit/recording.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <sndfile.hh>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "client_sdk/fit/statistics.h"
#include "proto/cpp/error_reason.h"

namespace carillon::fit {
namespace {

constexpr double kMostSeconds = 600;
/// A ring keeps this much of the sound before its blow, for the noise, and after it.
constexpr double kBefore_s = 0.25, kAfter_s = 3, kLeast_s = 0.06;
/// Length of the pieces whose energies are compared.
constexpr double kPiece_s = 0.002;
/// A blow is louder than this part of the loudest piece's energy, and than this multiple of the 20
/// ms before it. Modes that beat rise more slowly.
constexpr double kLeastPart = 0.03, kRise = 8;
constexpr size_t kPiecesBefore = 10;
/// Samples that are equal to the loudest, relative, and how many in a row a limit makes.
constexpr double kEqual = 1e-4;
constexpr size_t kRow = 2;
constexpr double kLeastClipped_s = 1e-3;
/// Length of the pieces whose noise is compared, and the time around a blow that is left out.
constexpr double kNoise_s = 0.05, kGuard_s = 0.02;
constexpr double kMostFall_db = 96;
/// Length of the pieces whose loudness is compared.
constexpr double kLoud_s = 0.02;

absl::Status Unreadable(const std::string& path, absl::string_view why) {
  return Refusal(absl::StatusCode::kInvalidArgument, "RECORDING_UNREADABLE",
                 absl::StrCat(path, " cannot be read as sound (", why,
                              "): give a WAV, AIFF, FLAC, Ogg or MP3 file of at most ten minutes; "
                              "for one of another kind, ffmpeg -i FILE tap.wav makes one"));
}

std::vector<double> Energies(const std::vector<float>& samples, size_t piece) {
  std::vector<double> energies(samples.size() / piece);
  for (size_t k = 0; k < energies.size(); ++k) {
    for (size_t i = k * piece; i < (k + 1) * piece; ++i) {
      energies[k] += double{samples[i]} * double{samples[i]};
    }
  }
  return energies;
}

/// Returns the pieces in which blows begin.
std::vector<size_t> Onsets(const std::vector<double>& energies) {
  std::vector<size_t> onsets;
  if (energies.empty()) return onsets;
  const double least = kLeastPart * *std::ranges::max_element(energies);
  for (size_t k = 0; k < energies.size(); ++k) {
    if (energies[k] <= least || energies[k] == 0) continue;
    const size_t from = k - std::min(k, kPiecesBefore);
    const double before =
        from == k ? 0
                  : *std::max_element(energies.begin() + static_cast<std::ptrdiff_t>(from),
                                      energies.begin() + static_cast<std::ptrdiff_t>(k));
    if (energies[k] > kRise * before || onsets.empty()) onsets.push_back(k);
  }
  return onsets;
}

}  // namespace

absl::StatusOr<Recording> ReadRecording(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(path, none)) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " is no file: see its name and rights"));
  }
  SndfileHandle file(path);
  if (file.error() != SF_ERR_NO_ERROR) return Unreadable(path, file.strError());
  const auto channels = static_cast<size_t>(file.channels());
  const sf_count_t frames = file.frames();
  if (frames <= 0 || static_cast<double>(frames) > kMostSeconds * file.samplerate()) {
    return Unreadable(path, frames <= 0 ? "it is empty" : "it is too long");
  }
  std::vector<float> interleaved(static_cast<size_t>(frames) * channels);
  const auto read = static_cast<size_t>(file.readf(interleaved.data(), frames));
  Recording recording{.name = path,
                      .sample_rate_hz = static_cast<double>(file.samplerate()),
                      .channels = std::vector(channels, std::vector<float>(read))};
  for (size_t i = 0; i < read * channels; ++i) {
    if (!std::isfinite(interleaved[i])) return Unreadable(path, "a sample is not finite");
    recording.channels[i % channels][i / channels] = interleaved[i];
  }
  return recording;
}

std::vector<Ring> FindRings(const std::vector<Recording>& recordings) {
  std::vector<Ring> rings;
  for (size_t r = 0; r < recordings.size(); ++r) {
    const double rate = recordings[r].sample_rate_hz;
    const size_t piece = std::max<size_t>(1, static_cast<size_t>(kPiece_s * rate));
    for (size_t c = 0; c < recordings[r].channels.size(); ++c) {
      const std::vector<float>& all = recordings[r].channels[c];
      const std::vector<size_t> onsets = Onsets(Energies(all, piece));
      for (size_t k = 0; k < onsets.size(); ++k) {
        const size_t onset = onsets[k] * piece;
        const size_t previous = k == 0 ? 0 : onset;
        const size_t begin =
            std::max(previous, onset - std::min(onset, static_cast<size_t>(kBefore_s * rate)));
        // The last pieces before the next blow may have its beginning.
        const size_t next =
            k + 1 < onsets.size() ? (std::max<size_t>(onsets[k + 1], 2) - 2) * piece : all.size();
        const size_t end = std::min(next, onset + static_cast<size_t>(kAfter_s * rate));
        if (end < onset + static_cast<size_t>(kLeast_s * rate)) continue;
        rings.push_back({.sample_rate_hz = rate,
                         .recording = r,
                         .channel = c,
                         .first_frame = begin,
                         .samples = {all.begin() + static_cast<std::ptrdiff_t>(begin),
                                     all.begin() + static_cast<std::ptrdiff_t>(end)},
                         .onset = onset - begin});
      }
    }
  }
  return rings;
}

double ClippedSeconds(const Recording& recording) {
  size_t most = 0;
  for (const std::vector<float>& samples : recording.channels) {
    double peak = 0;
    for (const float sample : samples) peak = std::max(peak, std::abs(double{sample}));
    size_t clipped = 0, row = 0;
    for (const float sample : samples) {
      row = peak > 0 && std::abs(double{sample}) >= (1 - kEqual) * peak ? row + 1 : 0;
      if (row >= kRow) clipped += row == kRow ? kRow : 1;
    }
    most = std::max(most, clipped);
  }
  const double seconds = static_cast<double>(most) / recording.sample_rate_hz;
  return seconds < kLeastClipped_s ? 0 : seconds;
}

double GateFallDb(const std::vector<Ring>& rings) {
  std::vector<double> falls_db;
  for (const Ring& ring : rings) {
    // Differences weaken the hum and the rumble of a room, which vary most.
    std::vector<float> differences(ring.samples.size());
    std::adjacent_difference(ring.samples.begin(), ring.samples.end(), differences.begin());
    const auto piece = static_cast<size_t>(kNoise_s * ring.sample_rate_hz);
    const auto guard = static_cast<size_t>(kGuard_s * ring.sample_rate_hz);
    if (piece == 0 || ring.onset < 2 * piece + guard) continue;
    const std::vector<double> energies = Energies(differences, piece);
    const size_t before = (ring.onset - guard) / piece, after = (ring.onset + guard) / piece + 1;
    if (after >= energies.size()) continue;
    // The first piece begins with a sample instead of a difference.
    const double noise = *std::min_element(energies.begin() + 1,
                                           energies.begin() + static_cast<std::ptrdiff_t>(before));
    const double rest =
        *std::min_element(energies.begin() + static_cast<std::ptrdiff_t>(after), energies.end());
    if (noise > 0) {
      falls_db.push_back(std::min(kMostFall_db, 10 * std::log10(noise / std::max(rest, 1e-30))));
    }
  }
  return falls_db.empty() ? 0 : Median(std::move(falls_db));
}

double LoudnessDb(const std::vector<Ring>& rings) {
  double loudest_db = 0;
  for (const Ring& ring : rings) {
    const size_t piece = std::max<size_t>(1, static_cast<size_t>(kLoud_s * ring.sample_rate_hz));
    const std::vector<double> energies = Energies(ring.samples, piece);
    if (energies.empty()) continue;
    const auto [least, most] = std::ranges::minmax_element(energies);
    if (*most > 0) loudest_db = std::max(loudest_db, 10 * std::log10(*most / (*least + 1e-12)));
  }
  return loudest_db;
}

}  // namespace carillon::fit
