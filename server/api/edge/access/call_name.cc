// SPDX-License-Identifier: Apache-2.0
#include "server/api/edge/access/call_name.h"

#include <google/protobuf/descriptor.h>

#include <map>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace carillon {
namespace {

constexpr const char* kServices[] = {
    "carillon.v1.AdminService",      "carillon.v1.AudioService",
    "carillon.v1.ContactService",    "carillon.v1.DecompositionService",
    "carillon.v1.ModalModelService", "carillon.v1.SceneService",
    "carillon.v1.ServerService"};

std::map<std::string, std::string, std::less<>> NamesOfCalls() {
  std::map<std::string, std::string, std::less<>> names;
  for (const char* service : kServices) {
    const auto* described =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service);
    for (int i = 0; described != nullptr && i < described->method_count(); ++i) {
      const std::string& name = described->method(i)->name();
      names[name] = absl::StrCat("/", described->full_name(), "/", name);
    }
  }
  return names;
}

}  // namespace

std::string CallName(absl::string_view function) {
  static const auto& names = *new std::map(NamesOfCalls());
  absl::ConsumeSuffix(&function, "Raw");
  const auto found = names.find(std::string(function));
  return found == names.end() ? std::string(function) : found->second;
}

}  // namespace carillon
