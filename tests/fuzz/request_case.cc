// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/request_case.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <cstdint>
#include <utility>

#include "absl/strings/str_cat.h"
#include "carillon/v1/admin_service.pb.h"
#include "carillon/v1/audio_service.pb.h"
#include "carillon/v1/contact_service.pb.h"
#include "carillon/v1/decomposition_service.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "carillon/v1/scene_service.pb.h"
#include "carillon/v1/server_service.pb.h"
#include "carillon/worker/v1/job_run_service.pb.h"

namespace carillon {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::MessageFactory;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;

std::vector<std::string> FindMethods() {
  std::vector<std::string> methods;
  for (const Descriptor* const request :
       {v1::CollectGarbageRequest::descriptor(), v1::ListenRequest::descriptor(),
        v1::RecordContactsRequest::descriptor(), v1::GetJobRequest::descriptor(),
        worker::v1::FetchMeshRequest::descriptor(), v1::UploadMeshRequest::descriptor(),
        v1::CreateSceneRequest::descriptor(), v1::GetServerInfoRequest::descriptor()}) {
    const ServiceDescriptor& service = *request->file()->service(0);
    for (int i = 0; i < service.method_count(); ++i) {
      methods.push_back(absl::StrCat(service.full_name(), "/", service.method(i)->name()));
    }
  }
  return methods;
}

}  // namespace

const std::vector<std::string>& AllMethods() {
  static const auto* const methods = new std::vector<std::string>(FindMethods());
  return *methods;
}

std::optional<RequestCase> ParseRequestCase(absl::string_view text) {
  const size_t end = text.find('\n');
  if (end == absl::string_view::npos) return std::nullopt;
  RequestCase request{.method = std::string(text.substr(0, end)), .messages = {}};
  const std::vector<std::string>& methods = AllMethods();
  if (std::ranges::find(methods, request.method) == methods.end()) return std::nullopt;
  text.remove_prefix(end + 1);
  google::protobuf::io::CodedInputStream input(reinterpret_cast<const uint8_t*>(text.data()),
                                               static_cast<int>(text.size()));
  uint32_t length = 0;
  while (input.ReadVarint32(&length)) {
    std::string message;
    const int left = static_cast<int>(text.size()) - input.CurrentPosition();
    input.ReadString(&message, static_cast<int>(std::min<uint32_t>(length, left)));
    request.messages.push_back(std::move(message));
  }
  return request;
}

std::string ToText(const RequestCase& request) {
  std::string text = absl::StrCat(request.method, "\n");
  google::protobuf::io::StringOutputStream stream(&text);
  google::protobuf::io::CodedOutputStream output(&stream);
  for (const std::string& message : request.messages) {
    output.WriteVarint32(static_cast<uint32_t>(message.size()));
    output.WriteString(message);
  }
  output.Trim();
  return text;
}

std::unique_ptr<google::protobuf::Message> NewRequest(const std::string& method) {
  std::string dotted = method;
  std::ranges::replace(dotted, '/', '.');
  const MethodDescriptor* const found = DescriptorPool::generated_pool()->FindMethodByName(dotted);
  const auto* const prototype =
      MessageFactory::generated_factory()->GetPrototype(found->input_type());
  return std::unique_ptr<google::protobuf::Message>(prototype->New());
}

}  // namespace carillon
