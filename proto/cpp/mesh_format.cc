// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/mesh_format.h"

#include <algorithm>

namespace carillon {

const MeshFormat* FindMeshFormat(std::string_view name) {
  const auto* found = std::ranges::find(kMeshFormats, name, &MeshFormat::name);
  return found == kMeshFormats.end() ? nullptr : found;
}

std::string MeshFormatNames() {
  std::string names;
  for (const MeshFormat& format : kMeshFormats) {
    const bool last = &format == &kMeshFormats.back();
    if (!names.empty()) names += last ? " or " : ", ";
    names += format.name;
  }
  return names;
}

}  // namespace carillon
