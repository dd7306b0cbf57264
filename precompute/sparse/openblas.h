// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// How many threads solvers may use from now on; zero: one for each processor.
void SetThreadCount(int count);
int ThreadCount();

/// While it lives dense kernels share their work among threads of their own; otherwise they run in
/// the thread that calls them, so that our threads may call them side by side.
class ScopedBlasThreads {
 public:
  explicit ScopedBlasThreads(int count);
  ~ScopedBlasThreads();
  ScopedBlasThreads(const ScopedBlasThreads&) = delete;
  ScopedBlasThreads& operator=(const ScopedBlasThreads&) = delete;
};

/// OpenBLAS chooses its kernels by the model number of the processor, and takes the oldest (SSE3)
/// where it does not know the number, as Debian 12's version does with most processors made since:
/// a factorization then takes three times as long. Returns the value of OPENBLAS_CORETYPE that
/// suits the instructions of this processor, or nullptr where OpenBLAS chose well or the variable
/// is set already. It is read when a process starts.
const char* BetterOpenBlasCore();

}  // namespace carillon::precompute
