// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/certificate_end.h"

#include <cmath>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

constexpr double kDayS = 24 * 60 * 60;
constexpr std::chrono::hours kWarningPeriod(24);

}  // namespace

std::optional<double> CertificateEnd::left_s() const {
  const int64_t end_unix_s = end_unix_s_;
  if (end_unix_s == 0) return std::nullopt;
  return static_cast<double>(end_unix_s) - 1e-3 * static_cast<double>(clock_.UnixMs());
}

std::optional<std::string> CertificateEnd::WarningDue() {
  const std::optional<double> left = left_s();
  if (!left || *left > kWarningDays * kDayS) return std::nullopt;
  const std::chrono::nanoseconds now = clock_.Monotonic();
  if (warned_ && now - *warned_ < kWarningPeriod) return std::nullopt;
  warned_ = now;
  const std::string when =
      *left < 0 ? "has expired, and clients refuse it"
                : absl::StrCat("expires in ", static_cast<int>(std::floor(*left / kDayS)), " days");
  return absl::StrCat("a certificate of the daemon ", when,
                      ": put a new one in its file, and reload the daemon (SIGHUP)");
}

}  // namespace carillon
