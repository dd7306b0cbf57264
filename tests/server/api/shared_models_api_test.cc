// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "server/decomposition/job/decomposition_request.h"
#include "tests/server/api/served_daemon.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

/// A daemon with two clients. The one over the Unix socket has every role. The one over TCP, the
/// neighbour, has the role submit but not the role administer.
class SharedModelsApi : public ServedDaemon {
 protected:
  SharedModelsApi() : ServedDaemon({.client_share = 1}, {"127.0.0.1:0"}) {}

  static grpc::Status Import(v1::ModalModelService::Stub& stub, const std::string& name,
                             const std::vector<v1::ModalModelRecord>& records) {
    v1::ImportModalModelResponse response;
    return ServedDaemon::Import(stub, name, records, response);
  }

  static std::vector<v1::ModalModelRecord> OtherRecords() {
    ModalModel other = *SmallModel();
    for (double& eigenvalue : other.eigenvalues) eigenvalue *= 2;
    return SampleRecords(other);
  }

  v1::ModalModelSummary Get(const std::string& name) {
    v1::GetModalModelRequest request;
    request.set_name(name);
    v1::GetModalModelResponse response;
    EXPECT_TRUE(Call(*models, &v1::ModalModelService::Stub::GetModalModel, request, response).ok());
    return response.modal_model();
  }

  std::unique_ptr<v1::ModalModelService::Stub> neighbours_ = v1::ModalModelService::NewStub(
      grpc::CreateChannel(addresses().back(), grpc::InsecureChannelCredentials()));
};

TEST_F(SharedModelsApi, AClientCannotReplaceTheModelOfOthers) {
  const std::string name = ImportSmallModel();
  const v1::ModalModelSummary before = Get(name);
  ExpectRefused(Import(*neighbours_, name, OtherRecords()), grpc::ALREADY_EXISTS,
                "MODAL_MODEL_EXISTS");
  EXPECT_TRUE(Import(*neighbours_, name, SampleRecords(*SmallModel())).ok()) << "the same model";
  const v1::ModalModelSummary after = Get(name);
  EXPECT_EQ(after.revision(), before.revision());
  EXPECT_EQ(after.eigenvalues(0), before.eigenvalues(0));
  EXPECT_TRUE(Import(*neighbours_, "", OtherRecords()).ok()) << "under a name of its own";
}

TEST_F(SharedModelsApi, WhoMayAdministerReplacesAModelThatIsNotPinned) {
  const std::string name = ImportSmallModel();
  v1::UpdateModalModelRequest pin;
  pin.set_name(name);
  pin.set_pinned(true);
  v1::UpdateModalModelResponse response;
  const auto update = &v1::ModalModelService::Stub::UpdateModalModel;
  ASSERT_TRUE(Call(*models, update, pin, response).ok());
  ExpectRefused(Import(*models, name, OtherRecords()), grpc::ALREADY_EXISTS, "MODAL_MODEL_EXISTS");
  pin.set_pinned(false);
  ASSERT_TRUE(Call(*models, update, pin, response).ok());
  const int64_t revision = response.modal_model().revision();
  EXPECT_TRUE(Import(*models, name, OtherRecords()).ok());
  EXPECT_GT(Get(name).revision(), revision);
}

TEST_F(SharedModelsApi, ARequestDoesNotChangeAPinnedModelOfOthers) {
  v1::CreateModalModelRequest request = RequestFor("mesh");
  request.mutable_settings()->set_poisson_ratio(SmallModel()->poisson_ratio);
  *request.mutable_material() = SmallMaterial();
  const std::string name = "modalModels/" + RequestDigest(*ResolveRequest(request));
  ASSERT_TRUE(Import(*models, name, SampleRecords(*SmallModel())).ok());
  v1::UpdateModalModelRequest pin;
  pin.set_name(name);
  pin.set_pinned(true);
  v1::UpdateModalModelResponse pinned;
  ASSERT_TRUE(Call(*models, &v1::ModalModelService::Stub::UpdateModalModel, pin, pinned).ok());
  v1::CreateModalModelResponse response;
  const auto create = &v1::ModalModelService::Stub::CreateModalModel;
  EXPECT_TRUE(Call(*neighbours_, create, request, response).ok())
      << "the model has every mode that this request wants";
  request.set_max_frequency_hz(1e9);
  for (int i = 0; i < 2; ++i) {
    ExpectRefused(Call(*neighbours_, create, request, response), grpc::PERMISSION_DENIED,
                  "ROLE_MISSING");
  }
  EXPECT_FALSE(Get(name).has_material());
  EXPECT_EQ(Get(name).revision(), pinned.modal_model().revision());
}

}  // namespace
}  // namespace carillon
