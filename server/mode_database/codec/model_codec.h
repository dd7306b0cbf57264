// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/modal_model.pb.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/model_checker.h"

namespace carillon {

/// Reads and writes the stored form of a modal model (proto/carillon/v1/modal_model.proto).

/// Reads the records of a file in protobuf's delimited form, one by one. Only one thread at a time
/// may use an object.
class ModelFileReader {
 public:
  /// Opens a file. Errors: NotFound (FILE_NOT_FOUND).
  static absl::StatusOr<ModelFileReader> Open(const std::filesystem::path& file);

  /// Reads from the present position of `descriptor`, which the caller closes.
  explicit ModelFileReader(int descriptor);
  ModelFileReader(ModelFileReader&&) noexcept;
  ModelFileReader& operator=(ModelFileReader&&) noexcept;
  ~ModelFileReader();

  /// Returns the next record, or nullopt at the end. Errors: InvalidArgument
  /// (MODAL_MODEL_MALFORMED).
  absl::StatusOr<std::optional<v1::ModalModelRecord>> Next();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Returns the bytes of a record in a file: the record's length as a varint, then the record.
std::string Delimited(const v1::ModalModelRecord& record);

/// Builds a model from its records and checks each of them.
class ModelDecoder {
 public:
  /// Adds a record. Errors: those of ModelChecker::Check.
  absl::Status Append(const v1::ModalModelRecord& record);

  /// Adds a chunk that follows the header. Equivalent to Append of a record with that chunk.
  absl::Status AppendChunk(const ChunkView& chunk);

  /// Returns the model. Must be the last call. Errors: those of ModelChecker::Finish.
  absl::StatusOr<ModalModel> Finish(const std::string& digest);

  const v1::ModalModelHeader& header() const { return checker_.header(); }

 private:
  void Take(const ChunkView& chunk);
  void MakeRoom(const v1::ModalModelHeader& header);

  ModelChecker checker_;
  ModalModel model_;
  std::vector<char*>
      destinations_;  // address for each array's first byte; null if the array is not kept
};

}  // namespace carillon
