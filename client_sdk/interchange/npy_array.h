// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon::interchange {

/// An array in NumPy's .npy format, which is a text that describes the numbers, then the numbers.
struct NpyArray {
  std::string type;             ///< NumPy's name of the type, such as "<f8"
  std::vector<uint64_t> shape;  ///< empty: a single number
  std::string bytes;            ///< row-major
};

/// Returns the bytes of the format (version 1.0) before the numbers, a multiple of 64 bytes.
std::string NpyHeader(const std::string& type, const std::vector<uint64_t>& shape);

/// Parses a .npy file. An array in Fortran's order is transposed to row-major order. Error messages
/// call the array `name`. Errors: InvalidArgument (MODEL_FILE_MALFORMED).
absl::StatusOr<NpyArray> ParseNpy(const std::string& name, std::string_view file);

/// Converts an array of floats ("<f4" or "<f8") to numbers. Errors: those of ParseNpy.
absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<double>& numbers);
absl::Status ToNumbers(const std::string& name, const NpyArray& array, std::vector<float>& numbers);

/// Converts an array of integers ("<u4", "<i4", "<u8" or "<i8") to numbers; none may be negative or
/// need more than 32 bits. Errors: those of ParseNpy.
absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<uint32_t>& numbers);

/// Returns the text of an array of one string, of bytes ("|S9") or of characters ("<U9"). Errors:
/// those of ParseNpy.
absl::StatusOr<std::string> ToText(const std::string& name, const NpyArray& array);

}  // namespace carillon::interchange
