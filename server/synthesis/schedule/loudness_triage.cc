// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/schedule/loudness_triage.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace carillon {

void LoudnessTriage::Clear() noexcept {
  bins_.fill({});
  all_ = {};
  first_merged_ = first_exact_ = 0;
}

size_t LoudnessTriage::Bin(float loudness) noexcept {
  // NaN counts as silent here; the bank refuses it later.
  const float positive = loudness > 0 ? loudness : 0;
  return std::min<size_t>(std::bit_cast<uint32_t>(positive) >> 20, kBins - 1);
}

void LoudnessTriage::Note(float loudness, double exact_work, double merged_work) noexcept {
  Work& bin = bins_[Bin(loudness)];
  bin.exact += exact_work;
  bin.merged += merged_work;
  all_.exact += exact_work;
  all_.merged += merged_work;
}

double LoudnessTriage::Decide(double most_work) noexcept {
  first_merged_ = first_exact_ = 0;
  if (all_.exact <= most_work) return all_.exact;
  if (all_.merged <= most_work) return ShareOut(most_work, all_.merged);
  first_merged_ = first_exact_ = kBins;
  double work = 0;
  while (first_merged_ > 0 && work + bins_[first_merged_ - 1].merged <= most_work) {
    work += bins_[--first_merged_].merged;
  }
  return work;
}

double LoudnessTriage::ShareOut(double most_work, double all_merged) noexcept {
  double work = all_merged;
  for (first_exact_ = kBins; first_exact_ > 0; --first_exact_) {
    const Work& bin = bins_[first_exact_ - 1];
    if (work + bin.exact - bin.merged > most_work) break;
    work += bin.exact - bin.merged;
  }
  return work;
}

float LoudnessTriage::shed_below() const noexcept {
  return std::bit_cast<float>(static_cast<uint32_t>(first_merged_) << 20);
}

Treatment LoudnessTriage::Treat(float loudness) const noexcept {
  const size_t bin = Bin(loudness);
  if (bin >= first_exact_) return Treatment::kExact;
  return bin >= first_merged_ ? Treatment::kMerged : Treatment::kShed;
}

}  // namespace carillon
