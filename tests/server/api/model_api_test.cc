// SPDX-License-Identifier: Apache-2.0
#include <google/protobuf/util/message_differencer.h>

#include "server/decomposition/job/decomposition_request.h"
#include "tests/server/api/served_daemon.h"

namespace carillon {
namespace {

class ModelApi : public ServedDaemon {
 protected:
  grpc::Status GetShapes(const std::string& name, const std::vector<uint32_t>& modes,
                         const std::vector<uint32_t>& vertices,
                         std::vector<v1::ModeShape>& shapes) {
    grpc::ClientContext context;
    auto request = Named<v1::GetShapesRequest>(name);
    request.mutable_modes()->Add(modes.begin(), modes.end());
    request.mutable_vertices()->Add(vertices.begin(), vertices.end());
    const auto reader = models->GetShapes(&context, request);
    v1::GetShapesResponse response;
    while (reader->Read(&response)) {
      shapes.insert(shapes.end(), response.shapes().begin(), response.shapes().end());
    }
    return reader->Finish();
  }

  grpc::Status Export(const std::string& name, std::vector<v1::ModalModelRecord>& records,
                      bool without_shapes = false) {
    grpc::ClientContext context;
    auto request = Named<v1::ExportModalModelRequest>(name);
    request.set_without_shapes(without_shapes);
    const auto reader = models->ExportModalModel(&context, request);
    v1::ExportModalModelResponse response;
    while (reader->Read(&response)) records.push_back(response.record());
    return reader->Finish();
  }
};

TEST_F(ModelApi, ARequestThatCannotBeComputedIsRefused) {
  v1::CreateModalModelRequest request = RequestFor("mesh");
  request.set_mesh_digest(std::string(64, '0'));
  ExpectRefused(Call(*models, &ModelStub::CreateModalModel, request), grpc::NOT_FOUND,
                "MESH_NOT_FOUND");
  request = RequestFor("mesh");
  request.set_mesh_format("doc");
  ExpectRefused(Call(*models, &ModelStub::CreateModalModel, request), kInvalid,
                "MESH_FORMAT_UNKNOWN");
}

TEST_F(ModelApi, AJobThatIsNotThereIsNotFound) {
  for (const std::string& name :
       {"jobs/" + std::string(64, '0'), std::string("jobs"), std::string()}) {
    grpc::ClientContext context;
    const auto reader = jobs->WatchJob(&context, Named<v1::WatchJobRequest>(name));
    for (const grpc::Status& status :
         {Call(*jobs, &JobStub::GetJob, Named<v1::GetJobRequest>(name)),
          Call(*jobs, &JobStub::CancelJob, Named<v1::CancelJobRequest>(name)), reader->Finish()}) {
      ExpectRefused(status, grpc::NOT_FOUND, "JOB_NOT_FOUND");
    }
  }
}

TEST_F(ModelApi, AnExportWithoutShapesHasEveryOtherArrayUnchanged) {
  const std::string name = ImportSmallModel();
  std::vector<v1::ModalModelRecord> whole;
  ASSERT_TRUE(Export(name, whole).ok());
  std::vector<v1::ModalModelRecord> rest;
  ASSERT_TRUE(Export(name, rest, true).ok());
  const auto shapes_array = static_cast<uint32_t>(whole[0].header().arrays_size() - 1);
  ASSERT_EQ(whole[0].header().arrays().rbegin()->name(), "shapes");
  whole[0].mutable_header()->mutable_arrays()->RemoveLast();
  std::erase_if(whole, [&](const v1::ModalModelRecord& record) {
    return record.has_chunk() && record.chunk().array() == shapes_array;
  });
  ASSERT_EQ(rest.size(), whole.size());
  for (size_t i = 0; i < rest.size(); ++i) {
    EXPECT_TRUE(google::protobuf::util::MessageDifferencer::Equals(rest[i], whole[i])) << i;
  }
}

TEST_F(ModelApi, ShapesOfModesAtVerticesAreThoseOfTheModelTo16Bits) {
  const std::string name = ImportSmallModel();
  const std::shared_ptr<const ModalModel> small_model = SmallModel();
  const ModalModel& model = *small_model;
  const auto mode_count = static_cast<uint32_t>(model.mode_count());
  std::vector<v1::ModeShape> shapes;
  ASSERT_TRUE(GetShapes(name, {mode_count - 1, 0}, {2, 1}, shapes).ok());
  ASSERT_EQ(shapes.size(), 2U);
  EXPECT_EQ(shapes[0].mode(), mode_count - 1);
  EXPECT_EQ(shapes[1].mode(), 0U);
  for (const v1::ModeShape& shape : shapes) {
    ASSERT_EQ(shape.components().size(), 12U);
    for (size_t i = 0; i < 6; ++i) {
      const size_t row = 3 * (i < 3 ? 2 : 1) + i % 3;
      const auto low = static_cast<uint8_t>(shape.components()[2 * i]);
      const auto high = static_cast<uint8_t>(shape.components()[2 * i + 1]);
      const auto number = static_cast<int16_t>(low | (high << 8U));
      // Half a step of the 16 bits.
      EXPECT_NEAR(number * shape.scale(), model.shapes[row * mode_count + shape.mode()],
                  0.51 * shape.scale());
    }
  }
  shapes.clear();
  ASSERT_TRUE(GetShapes(name, {}, {}, shapes).ok());
  ASSERT_EQ(shapes.size(), mode_count);
  EXPECT_EQ(shapes[0].components().size(), 6 * model.vertices.size());
  ExpectRefused(GetShapes(name, {mode_count}, {}, shapes), kInvalid, "INVALID_SETTINGS");
  ExpectRefused(GetShapes(name, {}, {1'000'000}, shapes), kInvalid, "INVALID_SETTINGS");
}

TEST_F(ModelApi, AListEndsAPageBeforeItIsTooLargeForAClient) {
  std::vector<v1::ModalModelRecord> records = SampleRecords(*SmallModel());
  records[0].mutable_header()->add_warnings(std::string(900'000, 'w'));
  for (const char digit : {'1', '2', '3', '4', '5', '6'}) {
    ASSERT_TRUE(Import(*models, "modalModels/" + std::string(64, digit), records).ok());
  }
  v1::ListModalModelsRequest request;
  size_t count = 0;
  do {
    const v1::ListModalModelsResponse page = Called(*models, &ModelStub::ListModalModels, request);
    EXPECT_LT(page.ByteSizeLong(), 3U << 20U);
    count += static_cast<size_t>(page.modal_models_size());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(count, 6U);
}

/// A daemon with two clients. The one over the Unix socket has every role. The one over TCP, the
/// neighbour, has the role submit but not the role administer.
class SharedModelsApi : public ServedDaemon {
 protected:
  SharedModelsApi() : ServedDaemon({.client_share = 1}, {"127.0.0.1:0"}) {}

  static std::vector<v1::ModalModelRecord> OtherRecords() {
    ModalModel other = *SmallModel();
    for (double& eigenvalue : other.eigenvalues) eigenvalue *= 2;
    return SampleRecords(other);
  }

  v1::ModalModelSummary Get(const std::string& name) {
    return Called(*models, &ModelStub::GetModalModel, Named<v1::GetModalModelRequest>(name))
        .modal_model();
  }

  /// Pins the model, or no longer; returns its revision.
  int64_t Pin(const std::string& name, bool pinned) {
    auto request = Named<v1::UpdateModalModelRequest>(name);
    request.set_pinned(pinned);
    return Called(*models, &ModelStub::UpdateModalModel, request).modal_model().revision();
  }

  std::unique_ptr<ModelStub> neighbours_ =
      v1::ModalModelService::NewStub(Connect(server_->addresses().back()));
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
  Pin(name, true);
  ExpectRefused(Import(*models, name, OtherRecords()), grpc::ALREADY_EXISTS, "MODAL_MODEL_EXISTS");
  const int64_t revision = Pin(name, false);
  EXPECT_TRUE(Import(*models, name, OtherRecords()).ok());
  EXPECT_GT(Get(name).revision(), revision);
}

TEST_F(SharedModelsApi, ARequestDoesNotChangeAPinnedModelOfOthers) {
  v1::CreateModalModelRequest request = RequestFor("mesh");
  request.mutable_settings()->set_poisson_ratio(SmallModel()->poisson_ratio);
  *request.mutable_material() = SmallMaterial();
  const std::string name = "modalModels/" + RequestDigest(*ResolveRequest(request));
  ASSERT_TRUE(Import(*models, name, SampleRecords(*SmallModel())).ok());
  const int64_t revision = Pin(name, true);
  EXPECT_TRUE(Call(*neighbours_, &ModelStub::CreateModalModel, request).ok())
      << "the model has every mode that this request wants";
  request.set_max_frequency_hz(1e9);
  for (int i = 0; i < 2; ++i) {
    ExpectRefused(Call(*neighbours_, &ModelStub::CreateModalModel, request),
                  grpc::PERMISSION_DENIED, "ROLE_MISSING");
  }
  EXPECT_FALSE(Get(name).has_material());
  EXPECT_EQ(Get(name).revision(), revision);
}

}  // namespace
}  // namespace carillon
