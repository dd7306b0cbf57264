// SPDX-License-Identifier: Apache-2.0
#include "server/api/reflection_service.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>
#include <utility>

#include "absl/status/status.h"
#include "grpc/reflection/v1/reflection.grpc.pb.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "proto/cpp/error_reason.h"
#include "server/api/exception_barrier.h"
#include "server/api/raw_service.h"
#include "server/api/status_conversion.h"

namespace carillon {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;

/// The answer repeats the request, and the request is parsed on one of gRPC's few threads.
constexpr size_t kMostRequestBytes = size_t{4} << 10;

const DescriptorPool& Pool() { return *DescriptorPool::generated_pool(); }

/// Adds a file and the files that it imports to an answer, each once.
template <typename Answer>
void AddFile(const FileDescriptor& file, std::set<const FileDescriptor*>& added, Answer& answer) {
  if (!added.insert(&file).second) return;
  google::protobuf::FileDescriptorProto proto;
  file.CopyTo(&proto);
  answer.add_file_descriptor_proto(proto.SerializeAsString());
  for (int i = 0; i < file.dependency_count(); ++i) AddFile(*file.dependency(i), added, answer);
}

/// Sets the answer to a file, or to an error if `file` is null.
template <typename Response>
void AnswerFile(const FileDescriptor* file, const std::string& wanted, Response& response) {
  if (file == nullptr) {
    auto& error = *response.mutable_error_response();
    error.set_error_code(grpc::StatusCode::NOT_FOUND);
    error.set_error_message(Legible(wanted) + " is not part of the contract");
    return;
  }
  std::set<const FileDescriptor*> added;
  AddFile(*file, added, *response.mutable_file_descriptor_response());
}

/// Sets the answer to the extensions of a type, of which the contract has none.
template <typename Response>
void AnswerExtensions(const std::string& type, Response& response) {
  if (Pool().FindMessageTypeByName(type) == nullptr) return AnswerFile(nullptr, type, response);
  response.mutable_all_extension_numbers_response()->set_base_type_name(type);
}

template <typename Response>
void AnswerServices(const std::vector<std::string>& names, Response& response) {
  auto& answer = *response.mutable_list_services_response();
  for (const std::string& name : names) answer.add_service()->set_name(name);
}

/// One call, which reads the next request when the answer to the previous one has been sent.
template <typename Request, typename Response>
class ReflectionCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, Response> {
 public:
  explicit ReflectionCall(const std::vector<std::string>& names) : names_(names) {
    this->StartRead(&bytes_);
  }

  void OnReadDone(bool ok) override {
    if (!ok) return this->Finish(grpc::Status::OK);
    const absl::Status status = WithoutExceptions([this] { return Answer(); });
    if (!status.ok()) return this->Finish(ToGrpcStatus(status));
    this->StartWrite(&response_);
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return this->Finish(grpc::Status::CANCELLED);
    this->StartRead(&bytes_);
  }

  void OnDone() override { delete this; }

 private:
  absl::Status Answer() {
    Request request;
    if (bytes_.Length() > kMostRequestBytes ||
        !grpc::SerializationTraits<Request>::Deserialize(&bytes_, &request).ok()) {
      return Refusal(absl::StatusCode::kInvalidArgument, "REQUEST_MALFORMED",
                     "a request for reflection must be a ServerReflectionRequest of at most 4 KiB");
    }
    response_.Clear();
    response_.set_valid_host(request.host());
    Fill(request);
    *response_.mutable_original_request() = std::move(request);
    return absl::OkStatus();
  }

  void Fill(const Request& request) {
    switch (request.message_request_case()) {
      case Request::kFileByFilename: {
        const std::string& name = request.file_by_filename();
        return AnswerFile(Pool().FindFileByName(name), name, response_);
      }
      case Request::kFileContainingSymbol: {
        const std::string& name = request.file_containing_symbol();
        return AnswerFile(Pool().FindFileContainingSymbol(name), name, response_);
      }
      case Request::kFileContainingExtension:
        return AnswerFile(nullptr, request.file_containing_extension().containing_type(),
                          response_);
      case Request::kAllExtensionNumbersOfType:
        return AnswerExtensions(request.all_extension_numbers_of_type(), response_);
      case Request::kListServices:
        return AnswerServices(names_, response_);
      default:
        auto& error = *response_.mutable_error_response();
        error.set_error_code(grpc::StatusCode::INVALID_ARGUMENT);
        error.set_error_message("the request asks for nothing that this service knows");
    }
  }

  const std::vector<std::string>& names_;
  grpc::ByteBuffer bytes_;
  Response response_;
};

template <typename Generated, typename Request, typename Response>
class ReflectionService final : public RawService<Generated> {
 public:
  explicit ReflectionService(std::vector<std::string> names) : names_(std::move(names)) {
    this->ReadRaw("ServerReflectionInfo", &ReflectionService::Open);
  }

 private:
  grpc::ServerBidiReactor<grpc::ByteBuffer, Response>* Open(grpc::CallbackServerContext*) {
    return new ReflectionCall<Request, Response>(names_);
  }

  const std::vector<std::string> names_;
};

}  // namespace

std::vector<std::unique_ptr<grpc::Service>> MakeReflectionServices(std::vector<std::string> names) {
  namespace v1 = grpc::reflection::v1;
  namespace v1alpha = grpc::reflection::v1alpha;
  names.emplace_back(v1::ServerReflection::service_full_name());
  names.emplace_back(v1alpha::ServerReflection::service_full_name());
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(
      std::make_unique<ReflectionService<v1::ServerReflection, v1::ServerReflectionRequest,
                                         v1::ServerReflectionResponse>>(names));
  services.push_back(std::make_unique<
                     ReflectionService<v1alpha::ServerReflection, v1alpha::ServerReflectionRequest,
                                       v1alpha::ServerReflectionResponse>>(std::move(names)));
  return services;
}

}  // namespace carillon
