// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/write_request_seeds.h"

#include <string>

#include "carillon/v1/contact_service.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "carillon/v1/scene_service.pb.h"
#include "tests/fuzz/request_case.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

const char kScene[] = "scenes/fuzz";

std::string Method(const std::string& name) {
  for (const std::string& method : AllMethods()) {
    if (method.ends_with("/" + name)) return method;
  }
  return {};
}

template <typename Request>
void Write(const std::filesystem::path& folder, const std::string& method,
           const std::vector<Request>& requests) {
  RequestCase input{.method = Method(method), .messages = {}};
  for (const Request& request : requests) input.messages.push_back(request.SerializeAsString());
  WriteBytes(folder / method, ToText(input));
}

v1::NewObject SmallObject() {
  v1::NewObject object;
  object.set_modal_model("modalModels/" + SmallModel()->digest);
  object.mutable_material()->set_preset("chime_aluminum");
  object.mutable_material()->set_poisson_ratio(SmallModel()->poisson_ratio);
  return object;
}

std::vector<v1::StreamContactsRequest> Contacts(const std::vector<v1::RenderRequest>& rendering) {
  std::vector<v1::StreamContactsRequest> requests(1);
  requests[0].mutable_start()->set_scene(kScene);
  requests[0].mutable_start()->set_step_s(0.01);
  for (const v1::RenderRequest& request : rendering) {
    if (!request.record().has_step()) continue;
    *requests.emplace_back().add_steps() = request.record().step();
  }
  return requests;
}

std::vector<v1::ImportModalModelRequest> Import() {
  std::vector<v1::ImportModalModelRequest> requests;
  for (const v1::ModalModelRecord& record : SampleRecords(*SmallModel())) {
    *requests.emplace_back().mutable_record() = record;
  }
  requests[0].set_name("modalModels/" + std::string(64, 'b'));
  requests[0].set_label("small");
  return requests;
}

v1::UploadMeshRequest Mesh() {
  v1::UploadMeshRequest request;
  request.set_data("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  return request;
}

}  // namespace

void WriteRequestSeeds(const std::filesystem::path& folder,
                       const std::vector<v1::RenderRequest>& rendering) {
  std::filesystem::create_directories(folder);
  for (const std::string& method : AllMethods()) {
    const RequestCase empty{.method = method, .messages = {""}};
    WriteBytes(folder / method.substr(method.find('/') + 1), ToText(empty));
  }
  v1::AddObjectsRequest objects;
  objects.set_scene(kScene);
  *objects.add_objects() = SmallObject();
  *objects.add_objects() = SmallObject();
  v1::UpdateObjectRequest moved;
  moved.set_name("scenes/fuzz/objects/1");
  moved.mutable_pose()->mutable_position_m()->set_x(1);
  v1::CreateSceneRequest scene;
  scene.set_id("other");
  scene.mutable_hearing()->set_reference_distance_m(1);
  Write<v1::AddObjectsRequest>(folder, "AddObjects", {objects});
  Write<v1::UpdateObjectRequest>(folder, "UpdateObject", {moved});
  Write<v1::CreateSceneRequest>(folder, "CreateScene", {scene});
  Write(folder, "StreamContacts", Contacts(rendering));
  Write(folder, "Render", rendering);
  Write(folder, "ImportModalModel", Import());
  Write<v1::UploadMeshRequest>(folder, "UploadMesh", {Mesh()});
}

}  // namespace carillon
