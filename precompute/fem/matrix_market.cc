// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/matrix_market.h"

#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {

absl::Status WriteMatrixMarket(const std::string& path, const SystemMatrices::Sparse& lower,
                               double scale) {
  std::FILE* file = std::fopen(path.c_str(), "w");
  bool ok = file != nullptr;
  if (ok) {
    std::fprintf(file, "%%%%MatrixMarket matrix coordinate real symmetric\n%ld %ld %ld\n",
                 lower.rows(), lower.cols(), lower.nonZeros());
    for (Eigen::Index column = 0; column < lower.cols(); ++column) {
      for (SystemMatrices::Sparse::InnerIterator entry(lower, column); entry; ++entry) {
        std::fprintf(file, "%ld %ld %.17g\n", entry.row() + 1, column + 1, scale * entry.value());
      }
    }
    ok = std::ferror(file) == 0;
    ok = std::fclose(file) == 0 && ok;
  }
  if (ok) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat(path,
                              " cannot be written; check that its folder exists, is writable "
                              "and has room"));
}

}  // namespace carillon::precompute
