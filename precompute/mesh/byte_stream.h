// SPDX-License-Identifier: AGPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <vector>

namespace carillon::precompute {

/// Appends the count of plain values and the values, for TakeValues in the same program.
template <typename T>
void AppendValues(std::string& bytes, std::span<const T> values) {
  const size_t count = values.size();
  bytes.append(reinterpret_cast<const char*>(&count), sizeof count);
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

/// Takes off what AppendValues appended.
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
