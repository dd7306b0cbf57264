// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/output/output.h"

#include <gtest/gtest.h>

namespace carillon::cli {
namespace {

TEST(Counted, HasTheSingularForOneOnly) {
  EXPECT_EQ(Counted(0, "model"), "0 models");
  EXPECT_EQ(Counted(1, "model"), "1 model");
  EXPECT_EQ(Counted(2, "model"), "2 models");
  EXPECT_EQ(Counted(1, "mesh"), "1 mesh");
  EXPECT_EQ(Counted(3, "mesh"), "3 meshes");
}

}  // namespace
}  // namespace carillon::cli
