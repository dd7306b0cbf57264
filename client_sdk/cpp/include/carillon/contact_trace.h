// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fstream>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/contact_trace.pb.h"

namespace carillon::client {

/// Writes a contact trace file (proto/carillon/v1/contact_trace.proto).
class ContactTraceWriter {
 public:
  /// Begins the file with `header`, whose format_version it fills in.
  /// Errors: Internal (OUTPUT_NOT_WRITABLE).
  static absl::StatusOr<ContactTraceWriter> Create(const std::string& path,
                                                   v1::ContactTraceHeader header);

  /// All objects before the first step, steps in order of time. An error of the file shows in
  /// Close.
  void Write(const v1::ContactTraceObject& object);
  void Write(const v1::ContactStep& step);

  /// Errors: Internal (OUTPUT_NOT_WRITABLE): a write failed since the beginning.
  absl::Status Close();

 private:
  ContactTraceWriter(std::string path, std::ofstream file);
  void WriteRecord(const v1::ContactTraceRecord& record);

  std::string path_;
  std::ofstream file_;
};

/// Reads a contact trace file record by record.
class ContactTraceReader {
 public:
  /// Reads the header. Errors: NotFound (FILE_NOT_FOUND); InvalidArgument (TRACE_MALFORMED): it is
  /// no contact trace; Unimplemented (TRACE_TOO_NEW).
  static absl::StatusOr<ContactTraceReader> Open(const std::string& path);

  const v1::ContactTraceHeader& header() const { return header_; }

  /// The next object or step; empty after the last.
  /// Errors: InvalidArgument (TRACE_MALFORMED): the file ends within a record or is no trace.
  absl::StatusOr<std::optional<v1::ContactTraceRecord>> Next();

 private:
  ContactTraceReader(std::string path, std::ifstream file);
  absl::Status Malformed(absl::string_view what) const;

  std::string path_;
  std::ifstream file_;
  v1::ContactTraceHeader header_;
  uint64_t record_count_ = 0;
};

}  // namespace carillon::client
