// SPDX-License-Identifier: Apache-2.0
#include "proto/cpp/gltf_uri.h"

#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"

namespace carillon {
namespace {

std::optional<std::string> Unescape(absl::string_view uri) {
  std::string text;
  for (size_t i = 0; i < uri.size(); ++i) {
    if (uri[i] != '%') {
      text.push_back(uri[i]);
      continue;
    }
    int code = 0;
    if (!absl::SimpleHexAtoi(uri.substr(i + 1, 2), &code) || code == 0) return std::nullopt;
    text.push_back(static_cast<char>(code));
    i += 2;
  }
  return text;
}

}  // namespace

std::optional<std::string> FileOfGltfUri(const std::string& folder, const std::string& uri) {
  const std::optional<std::string> name = Unescape(uri);
  if (!name || name->empty() || absl::StrContains(uri, ":")) return std::nullopt;
  const std::filesystem::path path(*name);
  if (path.is_absolute()) return std::nullopt;
  for (const auto& part : path) {
    if (part == "..") return std::nullopt;
  }
  return (std::filesystem::path(folder) / path).string();
}

}  // namespace carillon
