// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <exception>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace carillon::precompute {

/// A fault of a glTF. It is thrown, as the JSON library throws its own, and caught by ParseGltf and
/// ParseGlb, which alone use these functions.
class GltfFault : public std::exception {
 public:
  explicit GltfFault(absl::Status status) : status_(std::move(status)) {}
  const char* what() const noexcept override { return "a fault of a glTF"; }
  const absl::Status& status() const { return status_; }

 private:
  absl::Status status_;
};

[[noreturn]] void FailGltf(absl::string_view what, absl::string_view reason = "MESH_UNREADABLE");

/// Numbers of an accessor: element e has the numbers `values[e * width ...]`.
struct GltfValues {
  size_t width;
  std::vector<double> values;
  size_t count() const { return values.size() / width; }
};

/// A glTF document with its buffers. https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
class GltfDocument {
 public:
  /// `binary` is the second chunk of a GLB, which must outlive the document. Fails if the document
  /// is not of version 2, or requires an extension that would change the surface and is not read.
  GltfDocument(std::string_view text, std::string_view binary);

  const nlohmann::json& root() const { return root_; }

  /// Returns element `index` of an array of the document. Fails if it has no such element.
  const nlohmann::json& At(const char* array, const nlohmann::json& index) const;

  /// Returns the numbers of an accessor of one of the types, such as "VEC3", normalized ones
  /// between -1 and 1, with the changes of a sparse accessor.
  GltfValues Read(const nlohmann::json& accessor_index, absl::string_view type) const;

 private:
  std::string_view BufferBytes(size_t index) const;
  /// The bytes of a buffer view from `offset` on.
  std::string_view ViewBytes(const nlohmann::json& view_index, size_t offset) const;
  struct Kind {
    int component;
    bool normalized;
  };
  void ApplySparse(const nlohmann::json& sparse, const Kind& kind, GltfValues& values) const;

  nlohmann::json root_;
  std::string_view binary_;
  std::vector<std::string> decoded_;  // the buffers that are in the document itself
};

}  // namespace carillon::precompute
