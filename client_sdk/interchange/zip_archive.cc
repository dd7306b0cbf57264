// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/zip_archive.h"

#include <zip.h>

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"
#include "proto/cpp/error_reason.h"

namespace carillon::interchange {
namespace {

constexpr uint64_t kMostBytes = 1ULL << 32;
constexpr size_t kPieceBytes = 1 << 20;

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* file) const { zip_fclose(file); }
};

std::string Words(int error) {
  zip_error_t details;
  zip_error_init_with_code(&details, error);
  std::string words = zip_error_strerror(&details);
  zip_error_fini(&details);
  return words;
}

absl::Status NotWritable(const std::string& path, const std::string& why) {
  return Refusal(
      absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
      absl::StrCat(path, ": ", why, "; check its folder, its permissions and the free space"));
}

/// Adds an entry, whose bytes the caller keeps alive until the archive is closed.
bool Add(zip_t* archive, const ZipEntry& entry) {
  // libzip reads fragments only, and takes pointers to non-const bytes.
  std::array<zip_buffer_fragment_t, 2> pieces = {
      {{reinterpret_cast<zip_uint8_t*>(const_cast<char*>(entry.head.data())), entry.head.size()},
       {reinterpret_cast<zip_uint8_t*>(const_cast<char*>(entry.body.data())), entry.body.size()}}};
  zip_source_t* const source = zip_source_buffer_fragment(archive, pieces.data(), pieces.size(), 0);
  if (source == nullptr) return false;
  const zip_int64_t index = zip_file_add(archive, entry.name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (index < 0) {
    zip_source_free(source);
    return false;
  }
  const auto place = static_cast<zip_uint64_t>(index);
  // All entries have the first day of the format, so that a model gives the same bytes at any time.
  constexpr zip_uint16_t kFirstDay = (1U << 5U) | 1U;
  return zip_set_file_compression(archive, place, ZIP_CM_STORE, 0) == 0 &&
         zip_file_set_dostime(archive, place, 0, kFirstDay, 0) == 0;
}

}  // namespace

struct ZipReader::State {
  std::unique_ptr<zip_t, Discard> archive;
};

ZipReader::ZipReader(std::unique_ptr<State> state) : state_(std::move(state)) {}
ZipReader::ZipReader(ZipReader&&) noexcept = default;
ZipReader& ZipReader::operator=(ZipReader&&) noexcept = default;
ZipReader::~ZipReader() = default;

absl::StatusOr<ZipReader> ZipReader::Open(const std::string& path) {
  int error = 0;
  zip_t* const archive = zip_open(path.c_str(), ZIP_RDONLY, &error);
  if (archive != nullptr) {
    return ZipReader(std::make_unique<State>(State{std::unique_ptr<zip_t, Discard>(archive)}));
  }
  if (error == ZIP_ER_NOENT || error == ZIP_ER_OPEN || error == ZIP_ER_READ) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(path, " cannot be read (", Words(error),
                                "); check its name and its permissions"));
  }
  return Malformed(absl::StrCat(path, " is no .npz file, or is cut short (", Words(error), ")"));
}

absl::StatusOr<std::optional<std::string>> ZipReader::Read(const std::string& name) const {
  zip_t* const archive = state_->archive.get();
  const zip_int64_t index = zip_name_locate(archive, name.c_str(), 0);
  if (index < 0) return std::nullopt;
  const std::unique_ptr<zip_file_t, Discard> file(
      zip_fopen_index(archive, static_cast<zip_uint64_t>(index), 0));
  std::string bytes;
  zip_int64_t got = file == nullptr ? -1 : 1;
  // The file is read piece by piece, because the size that the archive states may be wrong.
  while (got > 0 && bytes.size() <= kMostBytes) {
    const size_t before = bytes.size();
    bytes.resize(before + kPieceBytes);
    got = zip_fread(file.get(), bytes.data() + before, kPieceBytes);
    bytes.resize(before + static_cast<size_t>(std::max<zip_int64_t>(got, 0)));
  }
  if (bytes.size() > kMostBytes) return TooLarge(absl::StrCat(name, " has over 4 GiB"));
  if (got < 0)
    return Malformed(absl::StrCat(name, " in the .npz file is damaged; copy or export it again"));
  return bytes;
}

absl::Status WriteZip(const std::string& path, const std::vector<ZipEntry>& entries) {
  int error = 0;
  std::unique_ptr<zip_t, Discard> archive(
      zip_open(path.c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error));
  if (archive == nullptr) return NotWritable(path, Words(error));
  const bool added = std::ranges::all_of(
      entries, [&](const ZipEntry& entry) { return Add(archive.get(), entry); });
  if (added && zip_close(archive.get()) == 0) {
    // zip_close() has freed the archive.
    static_cast<void>(archive.release());
    return absl::OkStatus();
  }
  return NotWritable(path, zip_strerror(archive.get()));
}

}  // namespace carillon::interchange
