// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// Draws one line on standard error repeatedly. Draws nothing if standard error is not a terminal.
class ProgressBar {
 public:
  ProgressBar();
  /// Leaves the terminal as if nothing had been drawn.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Draw(const v1::Progress& progress) const;

 private:
  bool on_terminal_;
};

}  // namespace carillon::precompute
