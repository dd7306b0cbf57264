// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/mesh/read/text/text_encoding.h"

#include <iconv.h>

#include "absl/cleanup/cleanup.h"

namespace carillon::precompute {
namespace {

/// Whether the bytes begin with a byte order mark of UTF-16 and an ASCII character, which no binary
/// format of meshes does.
bool BeginsAsUtf16(std::string_view bytes) {
  if (bytes.size() < 4) return false;
  const bool little = bytes.starts_with("\xFF\xFE") && bytes[2] != '\0' && bytes[3] == '\0';
  const bool big = bytes.starts_with("\xFE\xFF") && bytes[2] == '\0' && bytes[3] != '\0';
  return little || big;
}

}  // namespace

std::string_view WithoutByteOrderMark(std::string_view bytes) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (bytes.starts_with(kMark)) bytes.remove_prefix(kMark.size());
  return bytes;
}

std::optional<std::string> Utf8OfUtf16(std::string_view bytes) {
  if (!BeginsAsUtf16(bytes)) return std::nullopt;
  // "UTF-16" reads the byte order mark and leaves it out.
  const iconv_t converter = iconv_open("UTF-8", "UTF-16");
  // NOLINTNEXTLINE(performance-no-int-to-ptr): iconv_open reports its failure so
  if (converter == reinterpret_cast<iconv_t>(-1)) return std::nullopt;
  const absl::Cleanup close = [converter] { iconv_close(converter); };
  std::string text(bytes.size() / 2 * 3, '\0');  // a unit of two bytes takes at most three
  std::string input(bytes);
  char* from = input.data();
  size_t from_left = input.size();
  char* to = text.data();
  size_t to_left = text.size();
  if (iconv(converter, &from, &from_left, &to, &to_left) == static_cast<size_t>(-1)) {
    return std::nullopt;
  }
  text.resize(text.size() - to_left);
  return text;
}

}  // namespace carillon::precompute
