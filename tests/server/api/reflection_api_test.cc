// SPDX-License-Identifier: Apache-2.0
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/descriptor_database.h>

#include "grpc/reflection/v1/reflection.grpc.pb.h"
#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

namespace reflection = grpc::reflection::v1;
using testing::UnorderedElementsAre;

/// One call of the reflection service.
class Reflected {
 public:
  explicit Reflected(const std::shared_ptr<grpc::Channel>& channel)
      : stub_(reflection::ServerReflection::NewStub(channel)),
        stream_(stub_->ServerReflectionInfo(&context_)) {}

  /// Returns the answer to a request.
  reflection::ServerReflectionResponse Ask(const reflection::ServerReflectionRequest& request) {
    reflection::ServerReflectionResponse response;
    EXPECT_TRUE(stream_->Write(request) && stream_->Read(&response));
    EXPECT_EQ(response.original_request().SerializeAsString(), request.SerializeAsString());
    return response;
  }

  reflection::ServerReflectionResponse AskForSymbol(const std::string& name) {
    reflection::ServerReflectionRequest request;
    request.set_file_containing_symbol(name);
    return Ask(request);
  }

  grpc::Status End() {
    stream_->WritesDone();
    return stream_->Finish();
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<reflection::ServerReflection::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<reflection::ServerReflectionRequest,
                                           reflection::ServerReflectionResponse>>
      stream_;
};

class ReflectionTest : public ServedDaemon {};

TEST_F(ReflectionTest, ListsEveryServiceAndHasItsFile) {
  Reflected reflected(channel_);
  reflection::ServerReflectionRequest request;
  request.set_list_services("");
  const auto answer = reflected.Ask(request);
  std::vector<std::string> names;
  for (const auto& service : answer.list_services_response().service()) {
    names.push_back(service.name());
    EXPECT_TRUE(reflected.AskForSymbol(service.name()).has_file_descriptor_response())
        << service.name();
  }
  EXPECT_THAT(names,
              UnorderedElementsAre("carillon.v1.AdminService", "carillon.v1.AudioService",
                                   "carillon.v1.ContactService", "carillon.v1.DecompositionService",
                                   "carillon.v1.ModalModelService", "carillon.v1.SceneService",
                                   "carillon.v1.ServerService", "grpc.health.v1.Health",
                                   "grpc.reflection.v1.ServerReflection",
                                   "grpc.reflection.v1alpha.ServerReflection"));
  EXPECT_TRUE(reflected.End().ok());
}

TEST_F(ReflectionTest, SendsEachFileWithAllThatItImports) {
  Reflected reflected(channel_);
  const auto answer = reflected.AskForSymbol("carillon.v1.SceneService.AddObjects");
  google::protobuf::SimpleDescriptorDatabase files;
  for (const std::string& bytes : answer.file_descriptor_response().file_descriptor_proto()) {
    google::protobuf::FileDescriptorProto file;
    ASSERT_TRUE(file.ParseFromString(bytes));
    EXPECT_TRUE(files.Add(file)) << file.name();
  }
  google::protobuf::DescriptorPool pool(&files);
  const auto* const method = pool.FindMethodByName("carillon.v1.SceneService.AddObjects");
  ASSERT_NE(method, nullptr);
  EXPECT_NE(method->input_type()->FindFieldByName("objects"), nullptr);

  reflection::ServerReflectionRequest request;
  request.set_file_by_filename("carillon/v1/scene_service.proto");
  EXPECT_EQ(reflected.Ask(request).file_descriptor_response().SerializeAsString(),
            answer.file_descriptor_response().SerializeAsString());
}

TEST_F(ReflectionTest, AnswersTheOlderVersionToo) {
  namespace v1alpha = grpc::reflection::v1alpha;
  grpc::ClientContext context;
  const auto stub = v1alpha::ServerReflection::NewStub(channel_);
  const auto stream = stub->ServerReflectionInfo(&context);
  v1alpha::ServerReflectionRequest request;
  request.set_file_containing_symbol("carillon.v1.Contact");
  v1alpha::ServerReflectionResponse response;
  ASSERT_TRUE(stream->Write(request));
  ASSERT_TRUE(stream->Read(&response));
  EXPECT_GT(response.file_descriptor_response().file_descriptor_proto_size(), 0);
}

TEST_F(ReflectionTest, SaysWhatIsNotThere) {
  Reflected reflected(channel_);
  EXPECT_EQ(reflected.AskForSymbol("carillon.v1.Nothing").error_response().error_code(),
            grpc::StatusCode::NOT_FOUND);
  reflection::ServerReflectionRequest request;
  request.mutable_file_containing_extension()->set_containing_type("carillon.v1.Contact");
  EXPECT_EQ(reflected.Ask(request).error_response().error_code(), grpc::StatusCode::NOT_FOUND);
  request.set_all_extension_numbers_of_type("carillon.v1.Contact");
  EXPECT_EQ(reflected.Ask(request).all_extension_numbers_response().base_type_name(),
            "carillon.v1.Contact");
  EXPECT_EQ(reflected.Ask({}).error_response().error_code(), kInvalid);
}

}  // namespace
}  // namespace carillon
