// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/fem/matrix_market.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace carillon::precompute {
namespace {

SystemMatrices::Sparse SmallLowerTriangle() {
  SystemMatrices::Sparse matrix(2, 2);
  matrix.insert(0, 0) = 1.0 / 3;
  matrix.insert(1, 0) = -2;
  matrix.insert(1, 1) = 5;
  matrix.makeCompressed();
  return matrix;
}

TEST(MatrixMarket, HoldsTheScaledLowerTriangleWithAllDigits) {
  const std::string path = ::testing::TempDir() + "/matrix_market_test.mtx";
  ASSERT_TRUE(WriteMatrixMarket(path, SmallLowerTriangle(), 3).ok());
  std::ifstream file(path);
  std::string banner;
  std::getline(file, banner);
  EXPECT_EQ(banner, "%%MatrixMarket matrix coordinate real symmetric");
  int rows = 0, columns = 0, entries = 0;
  file >> rows >> columns >> entries;
  EXPECT_EQ(rows, 2);
  EXPECT_EQ(columns, 2);
  EXPECT_EQ(entries, 3);
  int row = 0, column = 0;
  double value = 0;
  file >> row >> column >> value;
  EXPECT_EQ(value, 1.0);
  file >> row >> column >> value;
  EXPECT_EQ(row, 2);
  EXPECT_EQ(column, 1);
  EXPECT_EQ(value, -6.0);
}

TEST(MatrixMarket, RefusesAFolderThatIsNotThere) {
  const absl::Status status = WriteMatrixMarket("/nowhere/K.mtx", SmallLowerTriangle(), 1);
  EXPECT_THAT(status.ToString(), ::testing::HasSubstr("OUTPUT_NOT_WRITABLE: /nowhere/K.mtx"));
}

}  // namespace
}  // namespace carillon::precompute
