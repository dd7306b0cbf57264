// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace carillon::precompute {

/// Appends the number of plain values and the values themselves, in a form that only TakeValues of
/// the same program reads.
template <typename T>
void AppendValues(std::string& bytes, std::span<const T> values) {
  const size_t count = values.size();
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

/// Reads values written by AppendValues and advances `bytes` to the first byte after them.
template <typename T>
std::vector<T> TakeValues(const char*& bytes) {
  size_t count = 0;
  std::memcpy(&count, bytes, sizeof count);
  std::vector<T> values(count);
  std::memcpy(values.data(), bytes + sizeof count, count * sizeof(T));
  bytes += sizeof count + count * sizeof(T);
  return values;
}

}  // namespace carillon::precompute
