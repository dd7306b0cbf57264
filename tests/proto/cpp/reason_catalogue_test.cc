// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/reason_catalogue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace carillon {
namespace {

using testing::HasSubstr;

TEST(ReasonCatalogue, HasEveryRowWithItsCells) {
  EXPECT_GT(Reasons().size(), 100U);
  for (const CatalogueReason& reason : Reasons()) {
    EXPECT_FALSE(reason.meaning.empty()) << reason.name;
    EXPECT_FALSE(reason.repair.empty()) << reason.name;
  }
  EXPECT_TRUE(std::ranges::any_of(Reasons(), [](const CatalogueReason& reason) {
    return reason.name == "CONTACTS_LATE" && reason.code.empty();
  }));
}

TEST(ReasonCatalogue, ALinkIsTheNameOfItsPage) {
  for (const CatalogueReason& reason : Reasons()) {
    EXPECT_EQ((reason.meaning + reason.repair).find("]("), std::string::npos) << reason.name;
  }
  EXPECT_THAT(FindReason("MODELS_NOT_SERVING")->repair,
              HasSubstr("'after DATABASE_LOST' in docs/troubleshoot.md"));
  EXPECT_THAT(FindReason("WORK_LEFT_OUT")->repair,
              HasSubstr("'what is left out' in docs/rendering.md"));
}

TEST(ReasonCatalogue, IsFoundByNameInAnyLettersAndByAWholeMessage) {
  for (const char* text : {"MESH_NOT_CLOSED", "mesh_not_closed", "MESH_NOT_CLOSED: 3 edges"}) {
    const auto reason = FindReason(text);
    ASSERT_TRUE(reason.ok()) << text;
    EXPECT_EQ(reason->name, "MESH_NOT_CLOSED");
    EXPECT_EQ(reason->code, "INVALID_ARGUMENT");
  }
}

TEST(ReasonCatalogue, ANameThatIsNotThereHasItsNearest) {
  EXPECT_THAT(FindReason("MESH_NOT_CLOSD").status().ToString(),
              HasSubstr("INVALID_SETTINGS: there is no reason MESH_NOT_CLOSD; did you mean "
                        "MESH_NOT_CLOSED?"));
  EXPECT_THAT(FindReason("closed_mesh").status().ToString(),
              HasSubstr("did you mean MESH_NOT_CLOSED?"));
  EXPECT_THAT(FindReason("qqqqqqqqqqqq").status().ToString(), HasSubstr("lists all"));
}

}  // namespace
}  // namespace carillon
