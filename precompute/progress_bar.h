// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include "carillon/v1/decomposition.pb.h"

namespace carillon::precompute {

/// One line on standard error, drawn over and over, where that is a terminal; otherwise nothing.
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
