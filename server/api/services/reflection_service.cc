// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/reflection_service.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>
#include <utility>

#include "absl/status/status.h"
#include "grpc/health/v1/health.pb.h"
#include "grpc/reflection/v1/reflection.grpc.pb.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "server/api/call/exception_barrier.h"
#include "server/api/call/status_conversion.h"

namespace carillon {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;

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

template <typename Response>
void AnswerError(grpc::StatusCode code, const std::string& message, Response& response) {
  response.mutable_error_response()->set_error_code(code);
  response.mutable_error_response()->set_error_message(message);
}

template <typename Response>
void AnswerNotFound(const std::string& what, Response& response) {
  AnswerError(grpc::StatusCode::NOT_FOUND, Legible(what) + " is not part of the contract",
              response);
}

template <typename Response>
void AnswerFile(const FileDescriptor* file, const std::string& wanted, Response& response) {
  if (file == nullptr) return AnswerNotFound(wanted, response);
  std::set<const FileDescriptor*> added;
  AddFile(*file, added, *response.mutable_file_descriptor_response());
}

/// One call, which reads the next request when the answer to the previous one has been sent.
template <typename Request, typename Response>
class ReflectionCall final : public grpc::ServerBidiReactor<Request, Response> {
 public:
  explicit ReflectionCall(const std::vector<std::string>& names) : names_(names) {
    this->StartRead(&request_);
  }

  void OnReadDone(bool ok) override {
    if (!ok) return this->Finish(grpc::Status::OK);
    response_ = Response();
    const absl::Status status = WithoutExceptions([this] {
      response_.set_valid_host(request_.host());
      *response_.mutable_original_request() = request_;
      Answer();
      return absl::OkStatus();
    });
    if (!status.ok()) return this->Finish(ToGrpcStatus(status));
    this->StartWrite(&response_);
  }

  void OnWriteDone(bool ok) override {
    if (!ok) return this->Finish(grpc::Status::CANCELLED);
    this->StartRead(&request_);
  }

  void OnDone() override { delete this; }

 private:
  void Answer() {
    switch (request_.message_request_case()) {
      case Request::kFileByFilename: {
        const std::string& name = request_.file_by_filename();
        return AnswerFile(Pool().FindFileByName(name), name, response_);
      }
      case Request::kFileContainingSymbol: {
        const std::string& name = request_.file_containing_symbol();
        return AnswerFile(Pool().FindFileContainingSymbol(name), name, response_);
      }
      // The contract has no extensions.
      case Request::kFileContainingExtension:
        return AnswerNotFound("the extension", response_);
      case Request::kAllExtensionNumbersOfType: {
        const std::string& type = request_.all_extension_numbers_of_type();
        if (Pool().FindMessageTypeByName(type) == nullptr) return AnswerNotFound(type, response_);
        return response_.mutable_all_extension_numbers_response()->set_base_type_name(type);
      }
      case Request::kListServices:
        for (const std::string& name : names_) {
          response_.mutable_list_services_response()->add_service()->set_name(name);
        }
        return;
      default:
        AnswerError(grpc::StatusCode::INVALID_ARGUMENT,
                    "the request asks for nothing that this service knows", response_);
    }
  }

  const std::vector<std::string>& names_;
  Request request_;
  Response response_;
};

template <typename Generated, typename Request, typename Response>
class ReflectionService final : public Generated::CallbackService {
 public:
  explicit ReflectionService(std::vector<std::string> names) : names_(std::move(names)) {}

 private:
  grpc::ServerBidiReactor<Request, Response>* ServerReflectionInfo(
      grpc::CallbackServerContext* /*context*/) override {
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
  // The linker leaves out a file of which nothing is used.
  grpc::health::v1::HealthCheckRequest::descriptor();
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(
      std::make_unique<ReflectionService<v1::ServerReflection, v1::ServerReflectionRequest,
                                         v1::ServerReflectionResponse>>(names));
  services.push_back(std::make_unique<
                     ReflectionService<v1alpha::ServerReflection, v1alpha::ServerReflectionRequest,
                                       v1alpha::ServerReflectionResponse>>(names));
  return services;
}

}  // namespace carillon
