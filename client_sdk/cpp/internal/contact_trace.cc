// SPDX-License-Identifier: Apache-2.0
#include "carillon/contact_trace.h"

#include <google/protobuf/util/delimited_message_util.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/cpp/internal/step_time.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::client {
namespace {

constexpr uint32_t kFormatVersion = 1;
/// A step of a million impulses is shorter. The first bytes of a file of another format are mostly
/// a greater length.
constexpr uint64_t kMaxRecordBytes = 64 << 20;

enum class Length { kRead, kEndOfFile, kCutOff, kTooLong };

/// Reads a record's length, a base-128 varint.
Length ReadLength(std::istream& in, uint64_t& length) {
  length = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    const int byte = in.get();
    if (byte < 0) return shift == 0 ? Length::kEndOfFile : Length::kCutOff;
    length |= static_cast<uint64_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return length <= kMaxRecordBytes ? Length::kRead : Length::kTooLong;
  }
  return Length::kTooLong;
}

}  // namespace

ContactTraceWriter::ContactTraceWriter(std::string path, std::ofstream file)
    : path_(std::move(path)), file_(std::move(file)) {}

absl::StatusOr<ContactTraceWriter> ContactTraceWriter::Create(const std::string& path,
                                                              v1::ContactTraceHeader header) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) {
    return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                   absl::StrCat(path, ": ", std::strerror(errno), "; choose another file"));
  }
  ContactTraceWriter writer(path, std::move(file));
  v1::ContactTraceRecord record;
  *record.mutable_header() = std::move(header);
  record.mutable_header()->set_format_version(kFormatVersion);
  writer.WriteRecord(record);
  return writer;
}

void ContactTraceWriter::Write(const v1::ContactTraceObject& object) {
  v1::ContactTraceRecord record;
  *record.mutable_object() = object;
  WriteRecord(record);
}

absl::Status ContactTraceWriter::Write(const v1::ContactStep& step) {
  RETURN_IF_ERROR(
      CheckStepTime({.number = step_count_, .time_s = step.time_s(), .previous_s = time_s_},
                    absl::StrCat(path_, ": "), "write another trace"));
  v1::ContactTraceRecord record;
  *record.mutable_step() = step;
  WriteRecord(record);
  ++step_count_;
  time_s_ = step.time_s();
  return absl::OkStatus();
}

void ContactTraceWriter::WriteRecord(const v1::ContactTraceRecord& record) {
  google::protobuf::util::SerializeDelimitedToOstream(record, &file_);
}

absl::Status ContactTraceWriter::Close() {
  file_.close();
  if (file_) return absl::OkStatus();
  return Refusal(
      absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
      absl::StrCat(path_, ": a write failed, the trace is incomplete; is the disk full?"));
}

ContactTraceReader::ContactTraceReader(std::string path, std::ifstream file)
    : path_(std::move(path)), file_(std::move(file)) {}

absl::StatusOr<ContactTraceReader> ContactTraceReader::Open(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, ": ", std::strerror(errno), "; check the file's name"));
  }
  ContactTraceReader reader(path, std::move(file));
  ASSIGN_OR_RETURN(std::optional<v1::ContactTraceRecord> first, reader.Next());
  if (!first || !first->has_header() || first->header().format_version() == 0) {
    return reader.Malformed("does not begin with the header of a contact trace");
  }
  reader.header_ = first->header();
  if (reader.header_.format_version() > kFormatVersion) {
    return Refusal(absl::StatusCode::kUnimplemented, "TRACE_TOO_NEW",
                   absl::StrCat(path, ": has format version ", reader.header_.format_version(),
                                ", this program reads ", kFormatVersion, "; update it"));
  }
  return reader;
}

absl::StatusOr<std::optional<v1::ContactTraceRecord>> ContactTraceReader::Next() {
  uint64_t length = 0;
  switch (ReadLength(file_, length)) {
    case Length::kEndOfFile:
      return std::nullopt;
    case Length::kCutOff:
      return Malformed("ends within the length of a record");
    case Length::kTooLong:
      return Malformed("names an impossible length of a record");
    case Length::kRead:
      break;
  }
  std::string bytes(length, '\0');
  if (!file_.read(bytes.data(), static_cast<std::streamsize>(length))) {
    return Malformed("ends within a record");
  }
  v1::ContactTraceRecord record;
  if (!record.ParseFromString(bytes)) return Malformed("holds bytes that are no record");
  ++record_count_;
  return record;
}

absl::Status ContactTraceReader::NothingLeft() const {
  return Refusal(absl::StatusCode::kInvalidArgument, "TRACE_EMPTY",
                 absl::StrCat(path_,
                              ": holds nothing more to render: open the trace anew for each "
                              "rendering, and record a simulation in which something is "
                              "struck"));
}

absl::Status ContactTraceReader::Malformed(absl::string_view what) const {
  return Refusal(
      absl::StatusCode::kInvalidArgument, "TRACE_MALFORMED",
      absl::StrCat(path_, ": after ", record_count_, " records the file ", what,
                   "; it is no contact trace, or its recording was cut off: record it again"));
}

}  // namespace carillon::client
