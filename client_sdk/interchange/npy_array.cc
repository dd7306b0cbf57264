// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/npy_array.h"

#include <bit>
#include <cstring>
#include <limits>
#include <optional>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "client_sdk/interchange/file_refusal.h"

static_assert(std::endian::native == std::endian::little, "arrays are read as they lie in memory");

namespace carillon::interchange {
namespace {

constexpr char kNpyMagic[] = "\x93NUMPY";
constexpr size_t kMagicBytes = 6;
constexpr size_t kAlignment = 64;
constexpr uint64_t kMostItemBytes = 1 << 24;  // of a text

absl::Status BadArray(const std::string& name, absl::string_view what) {
  return Malformed(absl::StrCat("array \"", name, "\" ", what));
}

/// Returns the text after `key` in the text of the header, which is a Python dictionary.
std::optional<absl::string_view> After(absl::string_view text, absl::string_view key) {
  const size_t at = text.find(absl::StrCat("'", key, "'"));
  if (at == absl::string_view::npos) return std::nullopt;
  absl::string_view rest = absl::StripLeadingAsciiWhitespace(text.substr(at + key.size() + 2));
  if (!absl::StartsWith(rest, ":")) return std::nullopt;
  return absl::StripLeadingAsciiWhitespace(rest.substr(1));
}

/// Returns the part of `text` between `open`, with which the text must begin, and the next `close`.
std::optional<absl::string_view> Between(std::optional<absl::string_view> text, char open,
                                         char close) {
  if (!text || text->empty() || text->front() != open) return std::nullopt;
  const size_t end = text->find(close, 1);
  if (end == absl::string_view::npos) return std::nullopt;
  return text->substr(1, end - 1);
}

std::optional<std::vector<uint64_t>> ParseShape(absl::string_view text) {
  std::vector<uint64_t> shape;
  for (const absl::string_view part : absl::StrSplit(text, ',', absl::SkipWhitespace())) {
    uint64_t size = 0;
    if (!absl::SimpleAtoi(part, &size)) return std::nullopt;
    shape.push_back(size);
  }
  return shape;
}

/// Returns the bytes of one number, or zero for a type that is not supported.
uint64_t ItemBytes(const std::string& type) {
  uint64_t size = 0;
  if (type.size() < 3 || !absl::SimpleAtoi(type.substr(2), &size) || size > kMostItemBytes)
    return 0;
  if (absl::StartsWith(type, "|S")) return size;
  if (absl::StartsWith(type, "<U")) return 4 * size;
  const bool number = type == "<f4" || type == "<f8" || type == "<u4" || type == "<i4" ||
                      type == "<u8" || type == "<i8";
  return number ? size : 0;
}

/// Returns the bytes of the whole array, or nullopt if they exceed the address space.
std::optional<uint64_t> ByteCount(uint64_t item_bytes, const std::vector<uint64_t>& shape) {
  uint64_t count = item_bytes;
  for (const uint64_t size : shape) {
    if (size != 0 && count > std::numeric_limits<int64_t>::max() / size) return std::nullopt;
    count *= size;
  }
  return count;
}

/// Transposes from column-major to row-major order: in `turned` the last index runs fastest.
std::string Turned(std::string_view bytes, const std::vector<uint64_t>& shape, uint64_t item) {
  std::string turned;
  turned.reserve(bytes.size());
  std::vector<uint64_t> index(shape.size(), 0);
  std::vector<uint64_t> stride(shape.size(), item);
  for (size_t axis = 1; axis < shape.size(); ++axis)
    stride[axis] = stride[axis - 1] * shape[axis - 1];
  while (turned.size() < bytes.size()) {
    uint64_t at = 0;
    for (size_t axis = 0; axis < shape.size(); ++axis) at += index[axis] * stride[axis];
    turned.append(bytes.substr(at, item));
    for (size_t axis = shape.size(); axis > 0 && ++index[axis - 1] == shape[axis - 1]; --axis) {
      index[axis - 1] = 0;
    }
  }
  return turned;
}

/// The length and the beginning of the text of the header.
struct HeaderPlace {
  size_t begin = 0;
  size_t length = 0;
};

std::optional<HeaderPlace> FindHeader(std::string_view file) {
  if (file.size() < 12 || file.substr(0, kMagicBytes) != std::string_view(kNpyMagic, kMagicBytes)) {
    return std::nullopt;
  }
  HeaderPlace place;
  uint32_t length = 0;
  const bool is_short = file[kMagicBytes] == 1;
  const size_t length_bytes = is_short ? 2 : 4;
  std::memcpy(&length, file.data() + kMagicBytes + 2, length_bytes);
  place.begin = kMagicBytes + 2 + length_bytes;
  place.length = length;
  if (file.size() - place.begin < place.length) return std::nullopt;
  return place;
}

template <class From, class To>
void Convert(const std::string& bytes, std::vector<To>& numbers) {
  numbers.resize(bytes.size() / sizeof(From));
  for (size_t i = 0; i < numbers.size(); ++i) {
    From number;
    std::memcpy(&number, bytes.data() + i * sizeof number, sizeof number);
    numbers[i] = static_cast<To>(number);
  }
}

template <class To>
absl::Status ToFloats(const std::string& name, const NpyArray& array, std::vector<To>& numbers) {
  if (array.type == "<f4") {
    Convert<float>(array.bytes, numbers);
  } else if (array.type == "<f8") {
    Convert<double>(array.bytes, numbers);
  } else {
    return BadArray(name, absl::StrCat("holds '", array.type, "' where '<f8' or '<f4' should be"));
  }
  return absl::OkStatus();
}

template <class From>
absl::Status ToIndices(const std::string& name, const NpyArray& array,
                       std::vector<uint32_t>& numbers) {
  std::vector<From> wide;
  Convert<From>(array.bytes, wide);
  numbers.clear();
  numbers.reserve(wide.size());
  for (const From number : wide) {
    if (number < 0 || static_cast<uint64_t>(number) > std::numeric_limits<uint32_t>::max()) {
      return BadArray(name, absl::StrCat("holds ", number, ", which is no index"));
    }
    numbers.push_back(static_cast<uint32_t>(number));
  }
  return absl::OkStatus();
}

void AppendUtf8(uint32_t code, std::string& text) {
  if (code < 0x80) {
    text.push_back(static_cast<char>(code));
    return;
  }
  const int further = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
  constexpr uint32_t kFirst[] = {0, 0xc0, 0xe0, 0xf0};
  text.push_back(static_cast<char>(kFirst[further] | (code >> (6 * further))));
  for (int i = further - 1; i >= 0; --i) {
    text.push_back(static_cast<char>(0x80U | ((code >> (6 * i)) & 0x3fU)));
  }
}

}  // namespace

std::string NpyHeader(const std::string& type, const std::vector<uint64_t>& shape) {
  std::string text = absl::StrCat("{'descr': '", type, "', 'fortran_order': False, 'shape': (",
                                  absl::StrJoin(shape, ", "), shape.size() == 1 ? "," : "", "), }");
  const size_t before = kMagicBytes + 4;
  text.append(kAlignment - (before + text.size() + 1) % kAlignment, ' ');
  text.push_back('\n');
  std::string header(kNpyMagic, kMagicBytes);
  header.append(
      {'\1', '\0', static_cast<char>(text.size() & 0xffU), static_cast<char>(text.size() >> 8U)});
  return header + text;
}

absl::StatusOr<NpyArray> ParseNpy(const std::string& name, std::string_view file) {
  const std::optional<HeaderPlace> place = FindHeader(file);
  if (!place) return BadArray(name, "is no .npy file, or is cut short");
  const absl::string_view text(file.data() + place->begin, place->length);
  const auto type = Between(After(text, "descr"), '\'', '\'');
  const auto dimensions = Between(After(text, "shape"), '(', ')');
  const auto order = After(text, "fortran_order");
  const auto shape = ParseShape(dimensions.value_or("?"));
  if (!type || !shape || !order) return BadArray(name, "has a header that is none");
  NpyArray array{.type = std::string(*type), .shape = *shape, .bytes = {}};
  const uint64_t item = ItemBytes(array.type);
  if (item == 0) {
    return BadArray(name, absl::StrCat("holds '", array.type,
                                       "', of which nothing is read; store floats as '<f4' or "
                                       "'<f8', indices as '<u4', '<i4', '<u8' or '<i8', and text "
                                       "as '<U' or '|S'"));
  }
  const std::string_view numbers = file.substr(place->begin + place->length);
  if (ByteCount(item, *shape) != numbers.size()) {
    return BadArray(name, absl::StrCat("of shape (", absl::StrJoin(*shape, ", "), ") and type '",
                                       array.type, "' has ", numbers.size(), " bytes"));
  }
  const bool turned = absl::StartsWith(*order, "True") && shape->size() > 1;
  array.bytes = turned ? Turned(numbers, *shape, item) : std::string(numbers);
  return array;
}

absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<double>& numbers) {
  return ToFloats(name, array, numbers);
}

absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<float>& numbers) {
  return ToFloats(name, array, numbers);
}

absl::Status ToNumbers(const std::string& name, const NpyArray& array,
                       std::vector<uint32_t>& numbers) {
  if (array.type == "<u4") return ToIndices<uint32_t>(name, array, numbers);
  if (array.type == "<i4") return ToIndices<int32_t>(name, array, numbers);
  if (array.type == "<u8") return ToIndices<uint64_t>(name, array, numbers);
  if (array.type == "<i8") return ToIndices<int64_t>(name, array, numbers);
  return BadArray(name, absl::StrCat("holds '", array.type, "' where integers should be"));
}

absl::StatusOr<std::string> ToText(const std::string& name, const NpyArray& array) {
  const bool bytes = absl::StartsWith(array.type, "|S");
  if (!array.shape.empty() || !(bytes || absl::StartsWith(array.type, "<U"))) {
    return BadArray(name, "must be a single text");
  }
  if (bytes) return array.bytes.substr(0, array.bytes.find('\0'));
  std::vector<uint32_t> codes;
  Convert<uint32_t>(array.bytes, codes);
  std::string text;
  for (const uint32_t code : codes) {
    if (code == 0) break;
    if (code > 0x10ffff) return BadArray(name, "holds what is no character");
    AppendUtf8(code, text);
  }
  return text;
}

}  // namespace carillon::interchange
