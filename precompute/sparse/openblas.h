// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

namespace carillon::precompute {

/// Sets the number of threads that solvers may use. Zero means one thread for each processor.
void SetThreadCount(int count);
int ThreadCount();

/// While an object of this class lives, OpenBLAS uses `count` threads. Otherwise OpenBLAS runs its
/// kernels in the calling thread, so that several threads may call them in parallel.
class ScopedBlasThreads {
 public:
  explicit ScopedBlasThreads(int count);
  ~ScopedBlasThreads();
  ScopedBlasThreads(const ScopedBlasThreads&) = delete;
  ScopedBlasThreads& operator=(const ScopedBlasThreads&) = delete;
};

/// OpenBLAS chooses its kernels by the model number of the processor. For an unknown number
/// OpenBLAS takes the oldest kernels (SSE3), with which a factorization takes three times as long.
/// The version of Debian 12 does not know most newer processors. Returns the value of
/// OPENBLAS_CORETYPE that suits the instructions of this processor, or nullptr if OpenBLAS chose
/// well or the variable is already set. OpenBLAS reads the variable when a process starts.
const char* BetterOpenBlasCore();

}  // namespace carillon::precompute
