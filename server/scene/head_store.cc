// SPDX-License-Identifier: Apache-2.0
#include "server/scene/head_store.h"

#include <mysofa.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr const char* kDefaultFile = "/usr/share/libmysofa/default.sofa";
/// Number of heads that are kept, each for another sample rate. A head takes 13 MB at 48 kHz, and
/// 51 MB at 192 kHz.
constexpr size_t kMostHeads = 2;

using Sofa = std::unique_ptr<MYSOFA_HRTF, decltype(&mysofa_free)>;

absl::Status Unusable(const std::string& file, absl::string_view fault) {
  return Refusal(absl::StatusCode::kFailedPrecondition, "HEAD_UNUSABLE",
                 absl::StrCat("the measured head ", file, " ", fault,
                              "; let the daemon's setting head name a SOFA file of head-related "
                              "impulse responses, or install Debian's libmysofa1"));
}

constexpr double kLowestRate_hz = 8000, kHighestRate_hz = 384000;
/// Greatest delay in a file that is accepted.
constexpr double kLongestDelay_s = 0.1;

bool AreWithin(std::span<const float> values, double most) {
  return std::ranges::all_of(values, [most](float value) { return std::abs(value) <= most; });
}

/// Returns whether the lengths of the arrays match the counts in the file, and every number can be
/// used.
bool IsWhole(const MYSOFA_HRTF& sofa, double rate_hz) {
  constexpr double kGreatest = 1e9;  // excludes infinities and NaN, too
  const size_t filter_count = size_t{sofa.M} * sofa.R;
  const std::span responses(sofa.DataIR.values, sofa.DataIR.elements);
  const std::span positions(sofa.SourcePosition.values, sofa.SourcePosition.elements);
  const std::span delays(sofa.DataDelay.values, sofa.DataDelay.elements);
  return sofa.R == 2 && sofa.M > 0 && sofa.N > 0 && responses.size() == filter_count * sofa.N &&
         positions.size() == 3 * size_t{sofa.M} &&
         (delays.size() == sofa.R || delays.size() == filter_count) &&
         AreWithin(responses, kGreatest) && AreWithin(positions, kGreatest) &&
         AreWithin(delays, kLongestDelay_s * rate_hz);
}

/// Returns why libmysofa, whose errors do not tell the causes apart, did not read a file.
std::string WhyUnread(const std::string& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return "does not exist";
  if (!std::filesystem::is_regular_file(file, error)) return "is not a file";
  if (!std::ifstream(file).is_open()) return "cannot be opened by the daemon's user";
  return "is no SOFA file (AES69), or is damaged";
}

absl::StatusOr<Sofa> Read(const std::string& file) {
  int error = MYSOFA_OK;
  Sofa sofa(mysofa_load(file.c_str(), &error), &mysofa_free);
  if (!sofa) return Unusable(file, WhyUnread(file));
  if (mysofa_check(sofa.get()) != MYSOFA_OK || sofa->DataSamplingRate.elements == 0) {
    return Unusable(file, "does not hold impulse responses of two ears by direction");
  }
  const double rate_hz = sofa->DataSamplingRate.values[0];
  if (!(rate_hz >= kLowestRate_hz && rate_hz <= kHighestRate_hz)) {
    return Unusable(file, absl::StrCat("has a sampling rate of ", rate_hz, " Hz; it must be ",
                                       kLowestRate_hz, " to ", kHighestRate_hz));
  }
  if (!IsWhole(*sofa, rate_hz)) {
    return Unusable(file,
                    absl::StrCat("does not hold finite impulse responses of two ears by ",
                                 "direction, with delays of at most ", kLongestDelay_s, " s"));
  }
  return sofa;
}

/// Returns the directions of the file. Its positions are Cartesian: x points ahead, y left, z up.
std::vector<MeasuredDirection> DirectionsOf(const MYSOFA_HRTF& sofa,
                                            std::span<const double> delays) {
  std::vector<MeasuredDirection> directions(sofa.M);
  const std::span responses(sofa.DataIR.values, sofa.DataIR.elements);
  for (size_t i = 0; i < directions.size(); ++i) {
    const float* const at = &sofa.SourcePosition.values[3 * i];
    directions[i].direction = {-at[1], at[2], -at[0]};
    for (size_t ear = 0; ear < 2; ++ear) {
      directions[i].responses[ear] = responses.subspan((2 * i + ear) * sofa.N, sofa.N);
      directions[i].delay_frames[ear] = delays[(2 * i + ear) % delays.size()];
    }
  }
  return directions;
}

absl::StatusOr<std::shared_ptr<const Head>> Load(const std::string& file, uint32_t rate_hz) {
  ASSIGN_OR_RETURN(const Sofa sofa, Read(file));
  const double ratio = static_cast<double>(rate_hz) / sofa->DataSamplingRate.values[0];
  std::vector<double> delays(sofa->DataDelay.values,
                             sofa->DataDelay.values + sofa->DataDelay.elements);
  for (double& delay : delays) delay *= ratio;
  if (mysofa_resample(sofa.get(), static_cast<float>(rate_hz)) != MYSOFA_OK) {
    return Unusable(file, absl::StrCat("cannot be resampled to ", rate_hz, " Hz"));
  }
  mysofa_tocartesian(sofa.get());
  return std::make_shared<const Head>(DirectionsOf(*sofa, delays), rate_hz);
}

}  // namespace

HeadStore::HeadStore(std::string file) : file_(file.empty() ? kDefaultFile : std::move(file)) {}

bool HeadStore::available() const {
  std::error_code ignored;
  return std::filesystem::exists(file_, ignored);
}

absl::Status HeadStore::Complete(SceneSpace& space, uint32_t sample_rate_hz,
                                 uint32_t channel_count) {
  if (!space.hearing.binaural || channel_count != 2) return absl::OkStatus();
  ASSIGN_OR_RETURN(space.head, Get(sample_rate_hz));
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const Head>> HeadStore::Get(uint32_t sample_rate_hz) {
  const MutexLock lock(&mutex_);
  const auto found = std::ranges::find(heads_, sample_rate_hz, &Made::sample_rate_hz);
  if (found != heads_.end()) {
    heads_.splice(heads_.begin(), heads_, found);
  } else {
    ASSIGN_OR_RETURN(std::shared_ptr<const Head> head, Load(file_, sample_rate_hz));
    heads_.push_front({sample_rate_hz, std::move(head)});
    if (heads_.size() > kMostHeads) heads_.pop_back();
  }
  return heads_.front().head;
}

}  // namespace carillon
