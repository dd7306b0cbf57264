// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/npz_model.h"

#include <map>
#include <new>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/complete_model.h"
#include "client_sdk/interchange/file_refusal.h"
#include "client_sdk/interchange/header_json.h"
#include "client_sdk/interchange/npy_array.h"
#include "client_sdk/interchange/zip_archive.h"
#include "proto/cpp/status_macros.h"

namespace carillon::interchange {
namespace {

const char* NpyTypeOf(double) { return "<f8"; }
const char* NpyTypeOf(float) { return "<f4"; }
const char* NpyTypeOf(uint32_t) { return "<u4"; }

absl::StatusOr<std::optional<NpyArray>> ReadArray(const ZipReader& archive,
                                                  const std::string& name) {
  ASSIGN_OR_RETURN(const auto file, archive.Read(name + ".npy"));
  if (!file.has_value()) return std::nullopt;
  ASSIGN_OR_RETURN(NpyArray array, ParseNpy(name, *file));
  return array;
}

/// Reads the arrays of the file. The shape of each must agree with its letters and with the arrays
/// before it.
class ArrayReader {
 public:
  explicit ArrayReader(const ZipReader& archive) : archive_(archive) {}

  template <class T>
  absl::Status Read(const std::string& name, std::vector<T>& numbers, std::string_view dimensions) {
    ASSIGN_OR_RETURN(const auto array, ReadArray(archive_, name));
    if (!array.has_value()) return absl::OkStatus();
    RETURN_IF_ERROR(CheckShape(name, array->shape, dimensions));
    return ToNumbers(name, *array, numbers);
  }

 private:
  absl::Status CheckShape(const std::string& name, const std::vector<uint64_t>& shape,
                          std::string_view dimensions) {
    bool fits = shape.size() == dimensions.size();
    for (size_t i = 0; fits && i < shape.size(); ++i) {
      fits = shape[i] > 0 && sizes_.emplace(dimensions[i], shape[i]).first->second == shape[i];
    }
    if (fits) return absl::OkStatus();
    return Malformed(absl::StrCat("the shape of array \"", name,
                                  "\" disagrees with the others or with "
                                  "what it must be"));
  }

  const ZipReader& archive_;
  std::map<char, uint64_t> sizes_ = {{'3', 3}};
};

absl::StatusOr<double> ReadPoissonRatio(const ZipReader& archive) {
  ASSIGN_OR_RETURN(const auto array, ReadArray(archive, "poisson_ratio"));
  if (!array.has_value()) {
    return Incomplete("the .npz file has neither \"header\" nor \"poisson_ratio\"",
                      "save one of them beside the arrays");
  }
  std::vector<double> numbers;
  RETURN_IF_ERROR(ToNumbers("poisson_ratio", *array, numbers));
  if (numbers.size() == 1 && numbers[0] > -1 && numbers[0] < 0.5) return numbers[0];
  return Malformed("\"poisson_ratio\" must be one number above -1 and below 0.5");
}

absl::StatusOr<v1::ModalModelHeader> ReadHeader(const ZipReader& archive) {
  ASSIGN_OR_RETURN(const auto array, ReadArray(archive, "header"));
  v1::ModalModelHeader header;
  if (array.has_value()) {
    ASSIGN_OR_RETURN(const std::string text, ToText("header", *array));
    auto parsed = HeaderFromJson(text);
    if (!parsed) return Malformed("\"header\" is not the JSON of a model's header");
    return *std::move(parsed);
  }
  ASSIGN_OR_RETURN(const double poisson_ratio, ReadPoissonRatio(archive));
  header.mutable_settings()->set_poisson_ratio(poisson_ratio);
  header.set_solver("NumPy");
  return header;
}

absl::Status RequireArrays(const StoredModel& model) {
  const std::pair<const char*, bool> needed[] = {{"eigenvalues", model.eigenvalues.empty()},
                                                 {"vertices", model.vertices.empty()},
                                                 {"triangles", model.triangles.empty()},
                                                 {"shapes", model.shapes.empty()}};
  for (const auto& [name, missing] : needed) {
    if (missing) {
      return Incomplete(absl::StrCat("the .npz file has no array \"", name, "\""),
                        "save it under that name");
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<StoredModel> ReadWhole(const std::string& path) {
  ASSIGN_OR_RETURN(const ZipReader archive, ZipReader::Open(path));
  StoredModel model;
  ArrayReader reader(archive);
  absl::Status status = absl::OkStatus();
  VisitArrays(model, [&](const char* name, auto& numbers, const char* dimensions) {
    if (status.ok()) status = reader.Read(name, numbers, dimensions);
  });
  if (status.ok()) status = RequireArrays(model);
  if (!status.ok()) return status;
  ASSIGN_OR_RETURN(model.header, ReadHeader(archive));
  status = Complete(model);
  if (!status.ok()) return status;
  return model;
}

}  // namespace

absl::Status WriteNpz(const std::string& path, const StoredModel& model) {
  std::vector<ZipEntry> entries;
  VisitArrays(
      model, [&]<class T>(const char* name, const std::vector<T>& numbers, const char* dimensions) {
        entries.push_back(
            {.name = absl::StrCat(name, ".npy"),
             .head = NpyHeader(NpyTypeOf(T()), Shape(model, dimensions)),
             .body = {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)}});
      });
  const std::string header = ToJson(model.header);
  entries.push_back({.name = "header.npy",
                     .head = NpyHeader(absl::StrCat("|S", header.size()), {}),
                     .body = header});
  return WriteZip(path, entries);
}

absl::StatusOr<StoredModel> ReadNpz(const std::string& path) {
  try {
    return ReadWhole(path);
  } catch (const std::bad_alloc&) {
    return OutOfMemory(path);
  }
}

}  // namespace carillon::interchange
