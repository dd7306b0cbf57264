// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/grpcpp.h>

namespace carillon {

/// The base of a service with streaming calls that derive from ClientStream or BidiStream
/// (stream_call.h). `Generated` is the class of the service that protoc has generated.
template <typename Generated>
class RawService : public Generated::CallbackService {
 protected:
  /// Lets `open` make the reactors of a method with streams of requests and responses, in place of
  /// the generated function. gRPC gives those reactors the bytes of each request.
  template <typename Service, typename Response>
  void ReadRaw(const char* method, grpc::ServerBidiReactor<grpc::ByteBuffer, Response>* (
                                       Service::*open)(grpc::CallbackServerContext*)) {
    auto* const service = static_cast<Service*>(this);
    this->MarkMethodRawCallback(IndexOf(method),
                                new grpc::internal::CallbackBidiHandler<grpc::ByteBuffer, Response>(
                                    [service, open](grpc::CallbackServerContext* context) {
                                      return (service->*open)(context);
                                    }));
  }

  /// The same for a method with a stream of requests and one response.
  template <typename Service, typename Response>
  void ReadRaw(const char* method, grpc::ServerReadReactor<grpc::ByteBuffer>* (Service::*open)(
                                       grpc::CallbackServerContext*, Response*)) {
    auto* const service = static_cast<Service*>(this);
    this->MarkMethodRawCallback(
        IndexOf(method),
        new grpc::internal::CallbackClientStreamingHandler<grpc::ByteBuffer, Response>(
            [service, open](grpc::CallbackServerContext* context, Response* response) {
              return (service->*open)(context, response);
            }));
  }

 private:
  static int IndexOf(const char* method) {
    return google::protobuf::DescriptorPool::generated_pool()
        ->FindServiceByName(Generated::service_full_name())
        ->FindMethodByName(method)
        ->index();
  }
};

}  // namespace carillon
