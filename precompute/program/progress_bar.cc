// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/progress_bar.h"

#include <unistd.h>

#include <cstdio>
#include <string>

#include "absl/strings/str_format.h"
#include "precompute/pipeline/phase_clock.h"

namespace carillon::precompute {
namespace {

constexpr size_t kWidth = 30;
constexpr char kEraseLine[] = "\r\x1b[K";

std::string RoughTime(double seconds) {
  if (seconds < 100) return absl::StrFormat("%.0f s", seconds);
  return seconds < 6000 ? absl::StrFormat("%.0f min", seconds / 60)
                        : absl::StrFormat("%.1f h", seconds / 3600);
}

}  // namespace

ProgressBar::ProgressBar() : on_terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (on_terminal_) std::fputs(kEraseLine, stderr);
}

void ProgressBar::Draw(const v1::Progress& progress) const {
  if (!on_terminal_) return;
  const auto done = static_cast<size_t>(progress.fraction() * kWidth);
  const std::string bar = std::string(done, '#') + std::string(kWidth - done, '.');
  std::fprintf(stderr, "%s[%s] %3.0f %% %s", kEraseLine, bar.c_str(), 100 * progress.fraction(),
               std::string(PhaseName(progress.phase())).c_str());
  if (progress.extent_m() > 0) std::fprintf(stderr, ", %.3g m across", progress.extent_m());
  if (progress.node_count() > 0) std::fprintf(stderr, ", %u nodes", progress.node_count());
  if (progress.converged_mode_count() > 0) {
    std::fprintf(stderr, ", %u modes", progress.converged_mode_count());
  }
  if (progress.remaining_s() > 0) {
    std::fprintf(stderr, ", %s left", RoughTime(progress.remaining_s()).c_str());
  }
  std::fflush(stderr);
}

}  // namespace carillon::precompute
