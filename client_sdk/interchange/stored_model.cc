// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/interchange/stored_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "client_sdk/interchange/file_refusal.h"

namespace carillon::interchange {
namespace {

uint64_t Size(const StoredModel& model, char dimension) {
  const ModelSizes sizes{.modes = model.mode_count(),
                         .vertices = model.vertex_count(),
                         .triangles = model.triangle_count(),
                         .given_vertices = model.given_vertices.size() / 3,
                         .given_triangles = model.given_triangles.size() / 3};
  return sizes.Of(dimension);
}

template <class T>
absl::Status CheckNumbers(const char* name, const std::vector<T>& numbers) {
  const auto bad = std::ranges::find_if(numbers, [](double x) { return !std::isfinite(x); });
  if (bad == numbers.end()) return absl::OkStatus();
  return Malformed(
      absl::StrCat("number ", bad - numbers.begin(), " of \"", name, "\" is not finite"));
}

absl::Status CheckIndices(const char* name, const std::vector<uint32_t>& indices, uint64_t bound) {
  const auto bad = std::ranges::find_if(indices, [&](uint32_t index) { return index >= bound; });
  if (bad == indices.end()) return absl::OkStatus();
  return Malformed(absl::StrCat("index ", bad - indices.begin(), " of \"", name, "\" is ", *bad,
                                ", but there are ", bound));
}

absl::Status CheckSizes(const StoredModel& model) {
  absl::Status status = absl::OkStatus();
  VisitArrays(model, [&](const char* name, const auto& numbers, const char* dimensions) {
    // The expected number is zero if a size is zero or if the product overflows.
    uint64_t expected = 1;
    for (const uint64_t size : Shape(model, dimensions)) {
      const bool fits = size > 0 && expected <= std::numeric_limits<uint64_t>::max() / size;
      expected = fits ? expected * size : 0;
    }
    if (status.ok() && (expected == 0 || numbers.size() != expected)) {
      status = Malformed(absl::StrCat("\"", name, "\" has ", numbers.size(), " numbers, where ",
                                      std::max<uint64_t>(expected, 1), " should be"));
    }
  });
  return status;
}

absl::Status CheckEigenvalues(const std::vector<double>& eigenvalues) {
  if (eigenvalues.front() > 0 && std::ranges::is_sorted(eigenvalues)) return absl::OkStatus();
  return Malformed("eigenvalues must be positive and ascend");
}

}  // namespace

std::vector<uint64_t> Shape(const StoredModel& model, std::string_view dimensions) {
  std::vector<uint64_t> shape;
  for (const char dimension : dimensions) shape.push_back(Size(model, dimension));
  return shape;
}

absl::Status Validate(const StoredModel& model) {
  for (const absl::Status& status :
       {CheckSizes(model), CheckNumbers("eigenvalues", model.eigenvalues),
        CheckNumbers("residuals", model.residuals), CheckNumbers("couplings", model.couplings),
        CheckNumbers("vertices", model.vertices),
        CheckNumbers("given_vertices", model.given_vertices), CheckNumbers("shapes", model.shapes),
        CheckIndices("triangles", model.triangles, model.vertex_count()),
        CheckIndices("given_triangle", model.given_triangle, Size(model, 'H')),
        CheckIndices("given_triangles", model.given_triangles, Size(model, 'G'))}) {
    if (!status.ok()) return status;
  }
  return CheckEigenvalues(model.eigenvalues);
}

}  // namespace carillon::interchange
