// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/server/api/served_daemon.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

class ModelApi : public ServedDaemon {
 protected:
  grpc::Status Create(const v1::CreateModalModelRequest& request, v1::Job& job) {
    grpc::ClientContext context;
    v1::CreateModalModelResponse response;
    grpc::Status status = models->CreateModalModel(&context, request, &response);
    job = response.job();
    return status;
  }

  grpc::Status GetShapes(const std::string& name, const std::vector<uint32_t>& modes,
                         const std::vector<uint32_t>& vertices,
                         std::vector<v1::ModeShape>& shapes) {
    grpc::ClientContext context;
    v1::GetShapesRequest request;
    request.set_name(name);
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
    v1::ExportModalModelRequest request;
    request.set_name(name);
    request.set_without_shapes(without_shapes);
    const auto reader = models->ExportModalModel(&context, request);
    v1::ExportModalModelResponse response;
    while (reader->Read(&response)) records.push_back(response.record());
    return reader->Finish();
  }
};

TEST_F(ModelApi, AMeshIsStoredUnderTheDigestOfItsBytes) {
  v1::UploadMeshResponse response;
  ASSERT_TRUE(Upload({"ab", "c"}, response).ok());
  EXPECT_EQ(response.mesh_digest(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-4
  EXPECT_EQ(response.byte_count(), 3U);
}

TEST_F(ModelApi, ARequestThatCannotBeComputedIsRefused) {
  const v1::CreateModalModelRequest good = RequestFor("mesh");
  v1::Job job;
  v1::CreateModalModelRequest request = good;
  request.set_mesh_digest(std::string(64, '0'));
  ExpectRefused(Create(request, job), grpc::NOT_FOUND, "MESH_NOT_FOUND");
  request = good;
  request.set_mesh_format("doc");
  ExpectRefused(Create(request, job), grpc::INVALID_ARGUMENT, "MESH_FORMAT_UNKNOWN");
  request = good;
  request.mutable_material()->set_preset("cheese");
  ExpectRefused(Create(request, job), grpc::INVALID_ARGUMENT, "UNKNOWN_MATERIAL");
  request = good;
  request.mutable_settings()->set_poisson_ratio(0.5);
  ExpectRefused(Create(request, job), grpc::INVALID_ARGUMENT, "INVALID_SETTINGS");
}

TEST_F(ModelApi, AWatchedJobIsSeenUntilItHasEnded) {
  v1::Job job;
  ASSERT_TRUE(Create(RequestFor("mesh"), job).ok());
  grpc::ClientContext context;
  v1::WatchJobRequest request;
  request.set_name(job.name());
  const auto reader = jobs->WatchJob(&context, request);
  v1::WatchJobResponse seen;
  int message_count = 0;
  while (reader->Read(&seen)) ++message_count;
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_GE(message_count, 1);
  EXPECT_EQ(seen.job().state(), v1::JOB_STATE_FAILED);  // its worker only exits
  EXPECT_NE(seen.job().error().reason(), "");

  v1::GetJobRequest get;
  get.set_name(job.name());
  v1::GetJobResponse got;
  grpc::ClientContext get_context;
  ASSERT_TRUE(jobs->GetJob(&get_context, get, &got).ok());
  EXPECT_EQ(got.job().state(), v1::JOB_STATE_FAILED);
  v1::ListJobsResponse listed;
  grpc::ClientContext list_context;
  ASSERT_TRUE(jobs->ListJobs(&list_context, {}, &listed).ok());
  ASSERT_EQ(listed.jobs_size(), 1);
  EXPECT_EQ(listed.jobs(0).name(), job.name());
}

TEST_F(ModelApi, AJobThatIsNotThereIsNotFound) {
  for (const std::string& name :
       {std::string("jobs/").append(64, '0'), std::string("jobs"), std::string()}) {
    v1::GetJobRequest get;
    get.set_name(name);
    v1::GetJobResponse got;
    grpc::ClientContext get_context;
    ExpectRefused(jobs->GetJob(&get_context, get, &got), grpc::NOT_FOUND, "JOB_NOT_FOUND");
    v1::CancelJobRequest cancel;
    cancel.set_name(name);
    v1::CancelJobResponse cancelled;
    grpc::ClientContext cancel_context;
    ExpectRefused(jobs->CancelJob(&cancel_context, cancel, &cancelled), grpc::NOT_FOUND,
                  "JOB_NOT_FOUND");
    v1::WatchJobRequest watch;
    watch.set_name(name);
    grpc::ClientContext watch_context;
    const auto reader = jobs->WatchJob(&watch_context, watch);
    v1::WatchJobResponse seen;
    EXPECT_FALSE(reader->Read(&seen));
    ExpectRefused(reader->Finish(), grpc::NOT_FOUND, "JOB_NOT_FOUND");
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
  ExpectRefused(GetShapes(name, {mode_count}, {}, shapes), grpc::INVALID_ARGUMENT,
                "INVALID_SETTINGS");
  ExpectRefused(GetShapes(name, {}, {1'000'000}, shapes), grpc::INVALID_ARGUMENT,
                "INVALID_SETTINGS");
}

TEST_F(ModelApi, AListEndsAPageBeforeItIsTooLargeForAClient) {
  std::vector<v1::ModalModelRecord> records = SampleRecords(*SmallModel());
  records[0].mutable_header()->add_warnings(std::string(900'000, 'w'));
  for (const char digit : {'1', '2', '3', '4', '5', '6'}) {
    v1::ImportModalModelResponse imported;
    ASSERT_TRUE(Import(*models, "modalModels/" + std::string(64, digit), records, imported).ok());
  }
  v1::ListModalModelsRequest request;
  size_t count = 0;
  do {
    v1::ListModalModelsResponse page;
    ASSERT_TRUE(Call(*models, &v1::ModalModelService::Stub::ListModalModels, request, page).ok());
    EXPECT_LT(page.ByteSizeLong(), 3U << 20U);
    count += static_cast<size_t>(page.modal_models_size());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(count, 6U);
}

}  // namespace
}  // namespace carillon
