// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "carillon/v1/contact.pb.h"
#include "carillon/v1/contact_trace.pb.h"

namespace carillon::client {

/// Writes a contact trace: a file of the contacts of a simulation, which Client::Render or the
/// command `carillon render` turns into sound later. proto/carillon/v1/contact_trace.proto
/// describes the file. One thread at a time may use a writer.
class ContactTraceWriter {
 public:
  /// Creates the file, or truncates it, and writes `header` with the format version of this
  /// library. Errors: INTERNAL (OUTPUT_NOT_WRITABLE).
  static absl::StatusOr<ContactTraceWriter> Create(const std::string& path,
                                                   v1::ContactTraceHeader header);

  /// Appends an object. It must be written before the first step that names it. Close() reports an
  /// error of the file.
  void Write(const v1::ContactTraceObject& object);

  /// Appends a simulation step. Steps must be written in the order of their times. Close() reports
  /// an error of the file. Errors: INVALID_ARGUMENT (INVALID_STREAM) if the step's time is not
  /// finite or goes back; the step is not written then, and the trace can be continued.
  absl::Status Write(const v1::ContactStep& step);

  /// Completes the file. Errors: INTERNAL (OUTPUT_NOT_WRITABLE) if any write has failed.
  absl::Status Close();

 private:
  ContactTraceWriter(std::string path, std::ofstream file);
  void WriteRecord(const v1::ContactTraceRecord& record);

  std::string path_;
  std::ofstream file_;
  uint64_t step_count_ = 0;
  double time_s_ = 0;  ///< of the last step
};

/// Reads a contact trace record by record. One thread at a time may use a reader.
class ContactTraceReader {
 public:
  /// Opens the file and reads its header. Errors: NOT_FOUND (FILE_NOT_FOUND), INVALID_ARGUMENT
  /// (TRACE_MALFORMED) if the file is not a contact trace, UNIMPLEMENTED (TRACE_TOO_NEW) if a newer
  /// version of Carillon wrote it.
  static absl::StatusOr<ContactTraceReader> Open(const std::string& path);

  const v1::ContactTraceHeader& header() const { return header_; }

  /// Returns the next object or step, or nullopt after the last one. Errors: INVALID_ARGUMENT
  /// (TRACE_MALFORMED) if the next bytes are not a whole record.
  absl::StatusOr<std::optional<v1::ContactTraceRecord>> Next();

  /// Returns the error for a caller who needs a further record: INVALID_ARGUMENT (TRACE_EMPTY).
  absl::Status NothingLeft() const;

 private:
  ContactTraceReader(std::string path, std::ifstream file);
  absl::Status Malformed(absl::string_view what) const;

  std::string path_;
  std::ifstream file_;
  v1::ContactTraceHeader header_;
  uint64_t record_count_ = 0;
};

}  // namespace carillon::client
