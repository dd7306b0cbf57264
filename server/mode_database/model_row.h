// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "carillon/v1/material.pb.h"
#include "carillon/v1/modal_model.pb.h"

namespace carillon {

/// Greatest number of tags of a model. A model to which an older version of Carillon gave more tags
/// is returned with the first kMaxTagCount of them.
inline constexpr size_t kMaxTagCount = 100;

/// Greatest size of the header of an imported model. A page of a list ends when its headers have
/// this size, so that every client can receive it.
inline constexpr size_t kMaxHeaderBytes = size_t{1} << 20U;

/// Greatest number of modes of an imported model. A decomposition finds no more.
inline constexpr uint32_t kMaxImportedModeCount = 20'000;

/// A modal model without its arrays.
struct ModelSummary {
  std::string digest{};
  std::string label{};  ///< given when it was first stored, or changed since
  v1::ModalModelHeader header{};
  uint64_t stored_bytes = 0;  ///< of its arrays
  int64_t created_unix_ms = 0;
  int64_t revision = 0;  ///< greater for everything stored later
  bool pinned = false;   ///< garbage collection leaves it alone
  int64_t sounded_unix_ms = 0;
  std::vector<std::string> tags{};  ///< ascending
  /// The material of the newest request for the model. It is absent if the model was imported.
  std::optional<v1::Material> material{};
};

/// Selects the models of a list: those that match all of the fields.
struct ModelFilter {
  std::string label_contains{};  ///< in upper or lower case
  std::string tag{};
  int64_t min_stored_bytes = 0;
  int64_t max_stored_bytes = std::numeric_limits<int64_t>::max();
  int64_t created_since_unix_ms = 0;
  int64_t created_before_unix_ms = std::numeric_limits<int64_t>::max();
};

/// A change of a model. Absent properties stay as they are.
struct ModelChange {
  std::optional<std::string> label{};
  std::vector<std::string> add_tags{};
  std::vector<std::string> remove_tags{};
  std::optional<bool> pinned{};
  std::optional<v1::Material> material{};
};

/// What a garbage collection needs to know of a model.
struct ModelSize {
  std::string digest{};
  uint64_t bytes = 0;  ///< of the model's arrays and its transfers
  bool pinned = false;
};

}  // namespace carillon
