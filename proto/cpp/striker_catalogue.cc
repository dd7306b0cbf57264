// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/striker_catalogue.h"

#include <google/protobuf/text_format.h>

#include <cstdlib>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_join.h"
#include "proto/cpp/near_names.h"

namespace carillon {
namespace {

constexpr char kCatalogueText[] =
#include "strikers.inc"
    ;

v1::StrikerCatalogue ParseCatalogue() {
  v1::StrikerCatalogue catalogue;
  if (!google::protobuf::TextFormat::ParseFromString(kCatalogueText, &catalogue)) std::abort();
  return catalogue;
}

std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const v1::CatalogueStriker& striker : Strikers().strikers()) {
    names.push_back(striker.name());
  }
  return names;
}

}  // namespace

const v1::StrikerCatalogue& Strikers() {
  static const v1::StrikerCatalogue catalogue = ParseCatalogue();
  return catalogue;
}

std::string StrikerNames() { return absl::StrJoin(Names(), ", "); }

absl::StatusOr<v1::CatalogueStriker> FindStriker(const std::string& name) {
  for (const v1::CatalogueStriker& striker : Strikers().strikers()) {
    if (striker.name() == name) return striker;
  }
  return UnknownName("UNKNOWN_STRIKER", "striker", name, Names());
}

}  // namespace carillon
