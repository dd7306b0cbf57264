// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "proto/cpp/model_format.h"

namespace carillon {

/// This file has the layout of a stored transfer, format version 1, for all code that writes, reads
/// or checks one. See TransferHeader.arrays in proto/carillon/v1/transfer.proto.

inline constexpr uint32_t kTransferFormatVersion = 1;

/// The arrays in the order in which they are stored. TransferSizes explains the letters.
inline constexpr std::array kTransferArrays = {
    ArraySpec{"eigenvalues", v1::ELEMENT_TYPE_FLOAT64, "m"},
    ArraySpec{"states", v1::ELEMENT_TYPE_UINT32, "m"},
    ArraySpec{"power_integrals", v1::ELEMENT_TYPE_FLOAT32, "m"},
    ArraySpec{"normal_energies", v1::ELEMENT_TYPE_FLOAT32, "m"},
    ArraySpec{"power_errors_db", v1::ELEMENT_TYPE_FLOAT32, "m"},
    ArraySpec{"direction_errors_db", v1::ELEMENT_TYPE_FLOAT32, "m"},
    ArraySpec{"orders", v1::ELEMENT_TYPE_UINT32, "m"},
    ArraySpec{"first", v1::ELEMENT_TYPE_UINT32, "M"},
    ArraySpec{"harmonics", v1::ELEMENT_TYPE_UINT32, "n"},
    ArraySpec{"coefficients", v1::ELEMENT_TYPE_FLOAT32, "n2"},
};
inline constexpr size_t kTransferArrayCount = kTransferArrays.size();

/// Values of the array "states".
enum class RadiationState : uint32_t { kOutsideBand = 0, kComputed = 1, kOutOfTime = 2 };

/// The lengths of the dimensions of a transfer's arrays.
struct TransferSizes {
  uint64_t modes;      ///< 'm'; 'M' is one more
  uint64_t harmonics;  ///< 'n', kept of all modes together

  constexpr uint64_t Of(char dimension) const {
    switch (dimension) {
      case 'm':
        return modes;
      case 'M':
        return modes + 1;
      case 'n':
        return harmonics;
      default:
        return 2;
    }
  }
};

}  // namespace carillon
