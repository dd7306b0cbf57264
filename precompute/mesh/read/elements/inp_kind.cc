// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/elements/inp_kind.h"

#include <algorithm>
#include <array>

#include "precompute/mesh/read/text/text_lines.h"

namespace carillon::precompute {
namespace {

/// Faces of shells, membranes, plane and rigid elements, by the number in their name.
std::optional<InpKind> FaceKind(int number) {
  if (number == 3) return InpKind{2, 3, 3};
  if (number == 4) return InpKind{2, 4, 4};
  if (number == 6 || number == 65) return InpKind{2, 6, 3};
  if (number == 8) return InpKind{2, 8, 4};
  return std::nullopt;
}

}  // namespace

std::optional<InpKind> FindInpKind(std::string_view type) {
  // The letters before the number, and the "3D" that belongs to them.
  size_t end = std::min(type.find_first_of("0123456789"), type.size());
  if (type.substr(end, 2) == "3D") end += 2;
  const std::string_view family = type.substr(0, end);
  const size_t digits = std::min(type.find_first_not_of("0123456789", end), type.size()) - end;
  const int number = ToNumber<int>(type.substr(end, digits)).value_or(0);
  if (family == "C3D" && number == 4) return InpKind{3, 4, 4};
  if (family == "C3D" && number == 10) return InpKind{3, 10, 4};
  if (family == "T3D" && number == 2) return InpKind{1, 2, 2};
  if (family == "T3D" && number == 3) return InpKind{1, 3, 2};
  constexpr std::array<std::string_view, 7> kFaces = {"S",   "STRI", "CPS",  "CPE",
                                                      "M3D", "R3D",  "SFM3D"};
  if (std::ranges::find(kFaces, family) != kFaces.end()) return FaceKind(number);
  return std::nullopt;
}

}  // namespace carillon::precompute
