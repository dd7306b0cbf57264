// SPDX-License-Identifier: Apache-2.0
#include "server/base/limited_log.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

namespace carillon {
namespace {

constexpr size_t kLongestLine = 400;

}  // namespace

void Allowance::Refill(std::chrono::nanoseconds now) {
  const double passed_s = std::chrono::duration<double>(now - refilled_).count();
  left_ = std::min(most_, left_ + passed_s);
  refilled_ = now;
}

bool Allowance::Has(std::chrono::nanoseconds now) {
  Refill(now);
  return left_ >= 1;
}

bool Allowance::Take(std::chrono::nanoseconds now) {
  if (!Has(now)) return false;
  left_ -= 1;
  return true;
}

bool Allowance::IsFull(std::chrono::nanoseconds now) {
  Refill(now);
  return left_ >= most_;
}

LimitedLog::~LimitedLog() {
  const MutexLock lock(&mutex_);
  SayWhatWasLeftOut();
}

void LimitedLog::Warn(absl::string_view line) {
  const MutexLock lock(&mutex_);
  if (!lines_.Take(clock_.Monotonic())) {
    ++left_out_count_;
    return;
  }
  SayWhatWasLeftOut();
  // No quotes enclose the line, so that its quotes need no escape.
  sink_(absl::StrReplaceAll(absl::CHexEscape(line.substr(0, kLongestLine)),
                            {{"\\'", "'"}, {"\\\"", "\""}}));
}

void LimitedLog::SayWhatWasLeftOut() {
  if (left_out_count_ == 0) return;
  sink_(absl::StrCat(left_out_count_, " more lines about ", subject_, " were left out"));
  left_out_count_ = 0;
}

}  // namespace carillon
