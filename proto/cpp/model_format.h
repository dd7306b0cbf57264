// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// This file has the layout of a stored modal model, format version 1, for all code that writes,
/// reads or checks one. See ModalModelHeader.arrays in proto/carillon/v1/modal_model.proto.

inline constexpr uint32_t kModelFormatVersion = 1;
inline constexpr size_t kMaxModelChunkBytes = 1 << 20;

struct ArraySpec {
  const char* name;
  v1::ElementType type;
  const char* shape;     ///< a letter of ModelSizes, or '3', for each dimension, slowest first
  char index_bound = 0;  ///< the dimension that indices count; 0 if the array has no indices
};

/// The arrays in the order in which they are stored.
inline constexpr std::array kModelArrays = {
    ArraySpec{"eigenvalues", v1::ELEMENT_TYPE_FLOAT64, "m"},
    ArraySpec{"residuals", v1::ELEMENT_TYPE_FLOAT64, "m"},
    ArraySpec{"couplings", v1::ELEMENT_TYPE_FLOAT64, "m"},
    ArraySpec{"vertices", v1::ELEMENT_TYPE_FLOAT32, "V3"},
    ArraySpec{"triangles", v1::ELEMENT_TYPE_UINT32, "T3", 'V'},
    ArraySpec{"given_triangle", v1::ELEMENT_TYPE_UINT32, "T", 'H'},
    ArraySpec{"given_vertices", v1::ELEMENT_TYPE_FLOAT32, "G3"},
    ArraySpec{"given_triangles", v1::ELEMENT_TYPE_UINT32, "H3", 'G'},
    ArraySpec{"shapes", v1::ELEMENT_TYPE_FLOAT32, "V3m"},
};
inline constexpr size_t kModelArrayCount = kModelArrays.size();

/// Returns the index in kModelArrays of the array of this name, or kModelArrayCount if there is
/// none.
constexpr size_t ModelArrayIndex(std::string_view name) {
  size_t index = 0;
  while (index < kModelArrayCount && name != kModelArrays[index].name) ++index;
  return index;
}

/// The lengths of the dimensions of a model's arrays.
struct ModelSizes {
  uint64_t modes;            ///< 'm'
  uint64_t vertices;         ///< 'V', of the sounding surface
  uint64_t triangles;        ///< 'T'
  uint64_t given_vertices;   ///< 'G', of the surface as given
  uint64_t given_triangles;  ///< 'H'

  constexpr uint64_t Of(char dimension) const {
    switch (dimension) {
      case 'm':
        return modes;
      case 'V':
        return vertices;
      case 'T':
        return triangles;
      case 'G':
        return given_vertices;
      case 'H':
        return given_triangles;
      default:
        return 3;
    }
  }
};

/// Returns the descriptor of an array. `Sizes` is ModelSizes or TransferSizes.
template <class Sizes>
v1::ArrayDescriptor DescribeArray(const ArraySpec& spec, const Sizes& sizes) {
  v1::ArrayDescriptor array;
  array.set_name(spec.name);
  array.set_type(spec.type);
  for (const char dimension : std::string_view(spec.shape)) array.add_shape(sizes.Of(dimension));
  return array;
}

}  // namespace carillon
