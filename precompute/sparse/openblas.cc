// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/sparse/openblas.h"

#include <cblas.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <string_view>
#include <thread>

namespace carillon::precompute {

namespace {

/// The process has one thread count, as OpenBLAS has.
std::atomic<int> thread_count = 1;

}  // namespace

void SetThreadCount(int count) {
  const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  thread_count = count > 0 ? count : processors;
  openblas_set_num_threads(1);
  // Hundreds of blocks of vectors are allocated and freed. Their memory is kept in the process,
  // because the kernel clears every page that it provides.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
}

int ThreadCount() { return thread_count; }

ScopedBlasThreads::ScopedBlasThreads(int count) { openblas_set_num_threads(count); }
ScopedBlasThreads::~ScopedBlasThreads() { openblas_set_num_threads(1); }

const char* BetterOpenBlasCore() {
#if defined(__x86_64__)
  if (std::getenv("OPENBLAS_CORETYPE") != nullptr) return nullptr;
  const std::string_view chosen = openblas_get_corename();
  if (chosen != "Prescott" && chosen != "Core2" && chosen != "Generic") return nullptr;
  if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw")) return "SkylakeX";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "Haswell";
#endif
  return nullptr;
}

}  // namespace carillon::precompute
