// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// How many threads factorizations may use from now on; zero: one for each processor.
void SetThreadCount(int count);

}  // namespace carillon::precompute
