// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace carillon::interchange {

/// One array as NumPy's .npy format has it: a text that describes the numbers, then the numbers.
struct NpyArray {
  std::string type;             ///< NumPy's, such as "<f8"
  std::vector<uint64_t> shape;  ///< empty: a single number
  std::string bytes;            ///< row-major
};

/// The format's bytes before the numbers (version 1.0, a multiple of 64 bytes).
std::string NpyHeader(const std::string& type, const std::vector<uint64_t>& shape);

/// Takes a .npy file apart; arrays in Fortran's order are turned. Errors: InvalidArgument
/// (MODEL_FILE_MALFORMED); `name` is for them.
absl::StatusOr<NpyArray> ParseNpy(const std::string& name, std::string_view file);

/// The numbers of an array of any size of float ("<f4", "<f8"). Errors: as ParseNpy.
absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<double>& numbers);
absl::Status ToNumbers(const std::string& name, const NpyArray& array, std::vector<float>& numbers);

/// Likewise of integers ("<u4", "<i4", "<u8", "<i8"), none negative or beyond 32 bits.
absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<uint32_t>& numbers);

/// The text of a single string of bytes ("|S9") or of characters ("<U9"). Errors: as ParseNpy.
absl::StatusOr<std::string> ToText(const std::string& name, const NpyArray& array);

}  // namespace carillon::interchange
