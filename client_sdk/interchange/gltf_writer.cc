// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/gltf_writer.h"

#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <string_view>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"
#include "proto/cpp/error_reason.h"

namespace carillon::interchange {
namespace {

using nlohmann::json;

// The types of components and the parts of a binary file, as glTF numbers them.
constexpr int kInt = 5125, kFloat = 5126;
constexpr uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;

void AppendWord(std::string& bytes, size_t word) {
  const auto narrow = static_cast<uint32_t>(word);
  bytes.append(reinterpret_cast<const char*>(&narrow), sizeof narrow);
}

bool WriteWhole(const std::string& path, const std::vector<std::string_view>& pieces) {
  const std::string temporary = absl::StrCat(path, ".partial-", getpid());
  std::ofstream out(temporary, std::ios::binary);
  for (const std::string_view piece : pieces) {
    out.write(piece.data(), static_cast<std::streamsize>(piece.size()));
  }
  out.close();
  if (out && std::rename(temporary.c_str(), path.c_str()) == 0) return true;
  unlink(temporary.c_str());
  return false;
}

/// Returns the least (or the greatest) value of each component of vectors.
template <class Better>
json Extreme(const std::vector<float>& numbers, Better better) {
  json extreme = {numbers[0], numbers[1], numbers[2]};
  for (size_t i = 3; i < numbers.size(); ++i) {
    if (better(numbers[i], extreme[i % 3].get<float>())) extreme[i % 3] = numbers[i];
  }
  return extreme;
}

}  // namespace

size_t GltfWriter::Add(const std::vector<float>& numbers, const std::string& type, Target target) {
  json accessor = {{"bufferView", AddView(numbers.data(), numbers.size() * sizeof(float), target)},
                   {"componentType", kFloat},
                   {"count", numbers.size() / (type == "VEC3" ? 3 : 1)},
                   {"type", type}};
  if (target == Target::kVertices) {
    accessor["min"] = Extreme(numbers, std::less());
    accessor["max"] = Extreme(numbers, std::greater());
  }
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

size_t GltfWriter::Add(const std::vector<uint32_t>& numbers, Target target) {
  accessors_.push_back(
      {{"bufferView", AddView(numbers.data(), numbers.size() * sizeof(uint32_t), target)},
       {"componentType", kInt},
       {"count", numbers.size()},
       {"type", "SCALAR"}});
  return accessors_.size() - 1;
}

size_t GltfWriter::AddView(const void* data, size_t byte_count, Target target) {
  // All arrays hold numbers of four bytes, so each begins at a multiple of four, as glTF demands.
  json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", byte_count}};
  if (target != Target::kNone) view["target"] = static_cast<int>(target);
  bytes_.append(static_cast<const char*>(data), byte_count);
  views_.push_back(std::move(view));
  return views_.size() - 1;
}

absl::Status GltfWriter::Write(const std::string& path, json asset, bool binary) const {
  asset["accessors"] = accessors_;
  asset["bufferViews"] = views_;
  const std::string& buffer = bytes_;
  asset["buffers"] = json::array({{{"byteLength", buffer.size()}}});
  std::string head;
  if (binary) {
    std::string text = asset.dump(-1, ' ', false, json::error_handler_t::replace);
    text.append((4 - text.size() % 4) % 4, ' ');
    const std::string padding((4 - buffer.size() % 4) % 4, '\0');
    const size_t total =
        kHeaderBytes + 2 * kChunkHeaderBytes + text.size() + buffer.size() + padding.size();
    if (total > std::numeric_limits<uint32_t>::max()) return TooLarge("a binary glTF holds 4 GiB");
    head.append("glTF");
    for (const size_t word : {size_t{2}, total, text.size(), size_t{kJsonChunk}})
      AppendWord(head, word);
    head += text;
    AppendWord(head, buffer.size() + padding.size());
    AppendWord(head, kBinaryChunk);
    if (WriteWhole(path, {head, buffer, padding})) return absl::OkStatus();
  } else {
    asset["buffers"][0]["uri"] =
        absl::StrCat("data:application/octet-stream;base64,", absl::Base64Escape(buffer));
    const std::string text = asset.dump(1, ' ', false, json::error_handler_t::replace);
    if (WriteWhole(path, {text})) return absl::OkStatus();
  }
  return Refusal(
      absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
      absl::StrCat(path,
                   " cannot be written; check its folder, its permissions and the free space"));
}

}  // namespace carillon::interchange
