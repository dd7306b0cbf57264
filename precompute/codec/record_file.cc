// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/codec/record_file.h"

#include <fcntl.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/model_format.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {

const char kSolver[] = "carillon-precompute " CARILLON_VERSION;

namespace {

using google::protobuf::io::FileInputStream;
using google::protobuf::io::FileOutputStream;
using google::protobuf::util::ParseDelimitedFromZeroCopyStream;
using google::protobuf::util::SerializeDelimitedToZeroCopyStream;

template <class Record>
bool WriteChunks(Bytes bytes, uint32_t index, FileOutputStream& file) {
  for (size_t offset = 0; offset < bytes.size(); offset += kMaxModelChunkBytes) {
    const auto piece = bytes.subspan(offset, std::min(kMaxModelChunkBytes, bytes.size() - offset));
    Record record;
    v1::ModalModelChunk& chunk = *record.mutable_chunk();
    chunk.set_array(index);
    chunk.set_offset(offset);
    chunk.set_data(piece.data(), piece.size());
    chunk.set_xxh3(XXH3_64bits(piece.data(), piece.size()));
    if (!SerializeDelimitedToZeroCopyStream(record, &file)) return false;
  }
  return true;
}

/// Writes all records and brings them to the disk, where there is one; closes the descriptor.
template <class Record>
bool WriteRecords(int descriptor, const Record& header, std::span<const Bytes> arrays) {
  if (descriptor < 0) return false;
  FileOutputStream file(descriptor);
  bool ok = SerializeDelimitedToZeroCopyStream(header, &file);
  for (size_t i = 0; i < arrays.size() && ok; ++i) {
    ok = WriteChunks<Record>(arrays[i], static_cast<uint32_t>(i), file);
  }
  // A pipe and most devices have nothing to bring to a disk.
  ok = ok && file.Flush() && (fsync(descriptor) == 0 || errno == EINVAL);
  return file.Close() && ok;
}

absl::Status CheckHash(const v1::ModalModelRecord& record) {
  if (!record.has_chunk()) return absl::OkStatus();
  const std::string& data = record.chunk().data();
  if (record.chunk().xxh3() == XXH3_64bits(data.data(), data.size())) return absl::OkStatus();
  return Refusal(absl::StatusCode::kDataLoss, "MODAL_MODEL_CORRUPT",
                 "the hash of a chunk of the modal model is wrong; compute the model again");
}

}  // namespace

template <class Record>
absl::Status WriteRecordFile(const std::string& path, const Record& header,
                             std::span<const Bytes> arrays) {
  std::error_code error;
  // A symbolic link stays, and what it names is replaced.
  const std::filesystem::path linked = std::filesystem::canonical(path, error);
  const std::string target = error ? path : linked.string();
  const auto write = [&](const std::string& name, int flags) {
    return WriteRecords(open(name.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666), header, arrays);
  };
  if (std::filesystem::exists(target, error) && !std::filesystem::is_regular_file(target, error)) {
    if (write(target, 0)) return absl::OkStatus();
  } else {
    const std::string temporary = absl::StrCat(target, ".partial-", getpid());
    if (write(temporary, O_CREAT | O_TRUNC) &&
        std::rename(temporary.c_str(), target.c_str()) == 0) {
      return absl::OkStatus();
    }
    unlink(temporary.c_str());
  }
  return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                 absl::StrCat("\"", path,
                              "\" cannot be written; check that its folder exists, is "
                              "writable and has room"));
}

template absl::Status WriteRecordFile(const std::string&, const v1::ModalModelRecord&,
                                      std::span<const Bytes>);
template absl::Status WriteRecordFile(const std::string&, const v1::TransferRecord&,
                                      std::span<const Bytes>);

absl::Status ReadModelRecords(const std::string& path,
                              const std::function<absl::Status(v1::ModalModelRecord&)>& take) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat("the modal model ", path,
                                " cannot be read; check its name and its permissions"));
  }
  FileInputStream file(descriptor);
  file.SetCloseOnDelete(true);
  v1::ModalModelRecord record;
  bool ended = false;
  // Parsing merges into the record, so that it must be empty before.
  for (; ParseDelimitedFromZeroCopyStream(&record, &file, &ended); record.Clear()) {
    RETURN_IF_ERROR(CheckHash(record));
    RETURN_IF_ERROR(take(record));
  }
  if (ended) return absl::OkStatus();
  return Refusal(absl::StatusCode::kInvalidArgument, "MODAL_MODEL_MALFORMED",
                 absl::StrCat(path,
                              " does not consist of the records of a modal model; give a "
                              "file that carillon-precompute wrote"));
}

}  // namespace carillon::precompute
