// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// A ModalModelChunk whose bytes are not copied. The bytes must outlive the view.
struct ChunkView {
  uint32_t array = 0;
  uint64_t offset = 0;
  uint64_t xxh3 = 0;
  std::string_view data;
};

/// Checks a stored model record by record: the hashes, the order and completeness of the chunks,
/// and the presence and shapes of the arrays of format version 1. Numbers must be finite,
/// eigenvalues positive and ascending, indices in range, and the sounding surface more than a
/// point. A reader of a model that passes needs no further checks.
class ModelChecker {
 public:
  /// Checks the next record. Errors: InvalidArgument (MODAL_MODEL_MALFORMED), DataLoss
  /// (MODAL_MODEL_CORRUPT: a hash is wrong). The checker cannot be used after an error.
  absl::Status Check(const v1::ModalModelRecord& record);

  /// Checks a chunk that follows the header and is not part of a record. Errors: those of Check.
  absl::Status CheckChunk(const ChunkView& chunk);

  /// Checks that every array is complete. Errors: InvalidArgument (MODAL_MODEL_MALFORMED).
  absl::Status Finish() const;

  const v1::ModalModelHeader& header() const { return header_; }

  /// Number of bytes in all arrays.
  uint64_t array_bytes() const;

 private:
  absl::Status CheckHeader(const v1::ModalModelHeader& header);
  absl::Status CheckRegions(const v1::ModalModelHeader& header) const;
  absl::Status CheckArray(const v1::ArrayDescriptor& array);
  absl::Status CheckShape(const v1::ArrayDescriptor& array);
  absl::Status CheckNumbers(const v1::ArrayDescriptor& array, std::string_view data);
  void CompareVertices(std::string_view data);

  bool has_header_ = false;
  v1::ModalModelHeader header_;
  std::vector<uint64_t> byte_counts_;    ///< size of each array
  std::map<char, uint64_t> dimensions_;  ///< 'V', 'T', 'm', 'G', 'H' of modal_model.proto
  int array_ = 0;                        ///< the array whose chunks come next
  uint64_t offset_ = 0;                  ///< offset of the next chunk
  double last_eigenvalue_ = 0;
  std::array<float, 3> first_vertex_{};
  uint64_t coordinate_count_ = 0;  ///< coordinates of vertices so far
  bool vertices_differ_ = false;
};

}  // namespace carillon
