// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/reflection_service.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <chrono>
#include <map>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "grpc/health/v1/health.pb.h"
#include "grpc/reflection/v1/reflection.grpc.pb.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "proto/cpp/error_reason.h"
#include "server/api/call/exception_barrier.h"
#include "server/api/call/raw_service.h"
#include "server/api/call/status_conversion.h"

namespace carillon {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;

/// The answer repeats the request, and the request is parsed on one of gRPC's few threads.
constexpr size_t kMostRequestBytes = size_t{4} << 10;
/// A tool asks for each service once.
constexpr int kMostRequests = 1000;

const DescriptorPool& Pool() { return *DescriptorPool::generated_pool(); }

/// The names and the files that the services tell. The files are serialized once, because a client
/// may ask for them often.
struct Contract {
  explicit Contract(std::vector<std::string> service_names) : names(std::move(service_names)) {
    for (const std::string& name : names) {
      const auto* const service = Pool().FindServiceByName(name);
      if (service != nullptr) AddFile(*service->file());
    }
  }

  void AddFile(const FileDescriptor& file) {
    if (!files.try_emplace(&file).second) return;
    google::protobuf::FileDescriptorProto proto;
    file.CopyTo(&proto);
    files[&file] = proto.SerializeAsString();
    for (int i = 0; i < file.dependency_count(); ++i) AddFile(*file.dependency(i));
  }

  std::vector<std::string> names;
  std::map<const FileDescriptor*, std::string> files;
};

/// Adds a file and the files that it imports to an answer, each once.
template <typename Answer>
void AddFile(const Contract& contract, const FileDescriptor& file,
             std::set<const FileDescriptor*>& added, Answer& answer) {
  if (!added.insert(&file).second) return;
  answer.add_file_descriptor_proto(contract.files.at(&file));
  for (int i = 0; i < file.dependency_count(); ++i) {
    AddFile(contract, *file.dependency(i), added, answer);
  }
}

template <typename Response>
void AnswerNotFound(const std::string& what, Response& response) {
  auto& error = *response.mutable_error_response();
  error.set_error_code(grpc::StatusCode::NOT_FOUND);
  error.set_error_message(Legible(what) + " is not part of the contract");
}

/// Sets the answer to a file of the contract, or to an error for another file or null.
template <typename Response>
void AnswerFile(const Contract& contract, const FileDescriptor* file, const std::string& wanted,
                Response& response) {
  if (!contract.files.contains(file)) return AnswerNotFound(wanted, response);
  std::set<const FileDescriptor*> added;
  AddFile(contract, *file, added, *response.mutable_file_descriptor_response());
}

/// Sets the answer to the extensions of a type, of which the contract has none.
template <typename Response>
void AnswerExtensions(const Contract& contract, const std::string& type, Response& response) {
  const Descriptor* const found = Pool().FindMessageTypeByName(type);
  if (found == nullptr || !contract.files.contains(found->file())) {
    return AnswerNotFound(type, response);
  }
  response.mutable_all_extension_numbers_response()->set_base_type_name(type);
}

template <typename Response>
void AnswerServices(const Contract& contract, Response& response) {
  auto& answer = *response.mutable_list_services_response();
  for (const std::string& name : contract.names) answer.add_service()->set_name(name);
}

/// One call, which reads the next request when the answer to the previous one has been sent. A call
/// whose client neither asks nor reads for too long is cancelled.
template <typename Request, typename Response>
class ReflectionCall final : public grpc::ServerBidiReactor<grpc::ByteBuffer, Response>,
                             public IdleCall {
 public:
  ReflectionCall(const Contract& contract, grpc::CallbackServerContext& context,
                 IdleCalls& idle_calls, const Clock& clock)
      : contract_(contract), context_(context), idle_calls_(idle_calls), wait_(clock) {
    idle_calls_.Add(*this);
    this->StartRead(&bytes_);
  }
  ~ReflectionCall() override { idle_calls_.Remove(*this); }

  void EndIfIdle(std::chrono::nanoseconds limit) override {
    if (wait_.EndIfLonger(limit)) context_.TryCancel();
  }

  void OnReadDone(bool ok) override {
    if (!wait_.Resume()) return this->Finish(grpc::Status::CANCELLED);
    if (!ok) return this->Finish(grpc::Status::OK);
    ++request_count_;
    const absl::Status status = WithoutExceptions([this] { return Answer(); });
    if (!status.ok()) return this->Finish(ToGrpcStatus(status));
    wait_.Begin();
    this->StartWrite(&response_);
  }

  void OnWriteDone(bool ok) override {
    if (!wait_.Resume() || !ok) return this->Finish(grpc::Status::CANCELLED);
    response_ = Response();  // an open call keeps no memory for it
    wait_.Begin();
    this->StartRead(&bytes_);
  }

  void OnDone() override { delete this; }

 private:
  absl::Status Answer() {
    if (request_count_ > kMostRequests) {
      return Refusal(absl::StatusCode::kResourceExhausted, "CLIENT_LIMIT_REACHED",
                     absl::StrCat("a call for reflection takes at most ", kMostRequests,
                                  " requests: begin another call"));
    }
    Request request;
    if (bytes_.Length() > kMostRequestBytes ||
        !grpc::SerializationTraits<Request>::Deserialize(&bytes_, &request).ok()) {
      return Refusal(absl::StatusCode::kInvalidArgument, "REQUEST_MALFORMED",
                     "a request for reflection must be a ServerReflectionRequest of at most 4 KiB");
    }
    response_.set_valid_host(request.host());
    Fill(request);
    *response_.mutable_original_request() = std::move(request);
    return absl::OkStatus();
  }

  void Fill(const Request& request) {
    switch (request.message_request_case()) {
      case Request::kFileByFilename: {
        const std::string& name = request.file_by_filename();
        return AnswerFile(contract_, Pool().FindFileByName(name), name, response_);
      }
      case Request::kFileContainingSymbol: {
        const std::string& name = request.file_containing_symbol();
        return AnswerFile(contract_, Pool().FindFileContainingSymbol(name), name, response_);
      }
      case Request::kFileContainingExtension: {
        const auto& wanted = request.file_containing_extension();
        return AnswerNotFound(
            absl::StrCat("extension ", wanted.extension_number(), " of ", wanted.containing_type()),
            response_);
      }
      case Request::kAllExtensionNumbersOfType:
        return AnswerExtensions(contract_, request.all_extension_numbers_of_type(), response_);
      case Request::kListServices:
        return AnswerServices(contract_, response_);
      default:
        auto& error = *response_.mutable_error_response();
        error.set_error_code(grpc::StatusCode::INVALID_ARGUMENT);
        error.set_error_message("the request asks for nothing that this service knows");
    }
  }

  const Contract& contract_;
  grpc::CallbackServerContext& context_;
  IdleCalls& idle_calls_;
  ClientWait wait_;
  grpc::ByteBuffer bytes_;
  int request_count_ = 0;
  Response response_;
};

template <typename Generated, typename Request, typename Response>
class ReflectionService final : public RawService<Generated> {
 public:
  ReflectionService(std::shared_ptr<const Contract> contract, IdleCalls& idle_calls,
                    const Clock& clock)
      : contract_(std::move(contract)), idle_calls_(idle_calls), clock_(clock) {
    this->ReadRaw("ServerReflectionInfo", &ReflectionService::Open);
  }

 private:
  grpc::ServerBidiReactor<grpc::ByteBuffer, Response>* Open(grpc::CallbackServerContext* context) {
    return new ReflectionCall<Request, Response>(*contract_, *context, idle_calls_, clock_);
  }

  const std::shared_ptr<const Contract> contract_;
  IdleCalls& idle_calls_;
  const Clock& clock_;
};

}  // namespace

std::vector<std::unique_ptr<grpc::Service>> MakeReflectionServices(std::vector<std::string> names,
                                                                   IdleCalls& idle_calls,
                                                                   const Clock& clock) {
  namespace v1 = grpc::reflection::v1;
  namespace v1alpha = grpc::reflection::v1alpha;
  names.emplace_back(v1::ServerReflection::service_full_name());
  names.emplace_back(v1alpha::ServerReflection::service_full_name());
  // The linker leaves out a file of which nothing is used.
  grpc::health::v1::HealthCheckRequest::descriptor();
  const auto contract = std::make_shared<const Contract>(std::move(names));
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(
      std::make_unique<ReflectionService<v1::ServerReflection, v1::ServerReflectionRequest,
                                         v1::ServerReflectionResponse>>(contract, idle_calls,
                                                                        clock));
  services.push_back(
      std::make_unique<
          ReflectionService<v1alpha::ServerReflection, v1alpha::ServerReflectionRequest,
                            v1alpha::ServerReflectionResponse>>(contract, idle_calls, clock));
  return services;
}

}  // namespace carillon
