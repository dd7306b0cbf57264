// SPDX-License-Identifier: Apache-2.0
// write_seeds FOLDER: writes small right files for each fuzzer into FOLDER/NAME.
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <filesystem>
#include <string>
#include <vector>

#include "carillon/v1/audio_service.pb.h"
#include "client_sdk/interchange/gltf_model.h"
#include "client_sdk/interchange/header_json.h"
#include "client_sdk/interchange/npy_array.h"
#include "client_sdk/interchange/npz_model.h"
#include "precompute/mesh/boundary.h"
#include "tests/client_sdk/interchange/small_model.h"
#include "tests/fuzz/write_request_seeds.h"
#include "tests/precompute/mesh/mesh_files.h"
#include "tests/server/mode_database/sample_model.h"
#include "tests/server/mode_database/sample_transfer.h"

namespace carillon {
namespace {

std::filesystem::path root;  // NOLINT: set once, by main

void Write(const std::string& fuzzer, const std::string& name, const std::string& bytes) {
  std::filesystem::create_directories(root / fuzzer);
  WriteBytes(root / fuzzer / name, bytes);
}

void WriteMeshes() {
  using namespace precompute;  // NOLINT(google-build-using-namespace)
  const SurfaceMesh surface = {.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                               .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  TetMesh mesh;
  mesh.nodes = surface.vertices;
  mesh.elements = {0, 1, 2, 3};
  FindBoundary(mesh).IgnoreError();
  Write("mesh_obj", "text", ToObj(surface));
  Write("mesh_off", "text", ToOff(surface));
  Write("mesh_ply", "text", ToTextPly(surface));
  Write("mesh_ply", "binary", ToBinaryPly(surface));
  Write("mesh_stl", "text", ToTextStl(surface));
  Write("mesh_stl", "binary", ToBinaryStl(surface));
  Write("mesh_msh", "text22", ToTextGmsh(mesh));
  Write("mesh_msh", "binary22", ToBinaryGmsh(mesh));
  Write("mesh_msh", "text41", ToTextGmsh41(mesh));
  Write("mesh_msh", "binary41", ToBinaryGmsh41(mesh));
  Write("mesh_inp", "text", ToInp(mesh));
  Write("mesh_mesh", "text", ToMedit(mesh));
  Write("mesh_node", "text", ToTetgen(mesh, 1));
}

void WriteInterchange() {
  using namespace interchange;  // NOLINT(google-build-using-namespace)
  const StoredModel model = SmallModel();
  const GltfNames names = {.body = "bell", .material = "bronze"};
  for (const char* fuzzer : {"gltf_model", "mesh_gltf", "mesh_glb", "npz"}) {
    std::filesystem::create_directories(root / fuzzer);
  }
  WriteGltfModel(root / "gltf_model/text.gltf", model, SmallMaterial(), names, false).IgnoreError();
  WriteGltfModel(root / "gltf_model/binary.glb", model, SmallMaterial(), names, true).IgnoreError();
  std::filesystem::copy(root / "gltf_model/text.gltf", root / "mesh_gltf/text");
  std::filesystem::copy(root / "gltf_model/binary.glb", root / "mesh_glb/binary");
  WriteNpz(root / "npz/whole", model).IgnoreError();
  Write("npy", "doubles", NpyHeader("<f8", {2, 1}) + std::string(16, '\1'));
  Write("npy", "floats", NpyHeader("<f4", {2}) + std::string(8, '\1'));
  Write("npy", "integers", NpyHeader("<u4", {}) + std::string(4, '\1'));
  Write("npy", "text", NpyHeader("|S4", {}) + "text");
  Write("model_header", "whole", ToJson(model.header));
}

void WriteStored() {
  std::string records;
  for (const v1::ModalModelRecord& record : SampleRecords(SampleModel(2, 4))) {
    records += Delimited(record);
  }
  Write("modal_model", "whole", records);
  Write("transfer", "whole",
        SampleTransferBytes(SampleModel(2, 4), {.power_integrals = {0.5F, 0.25F}}));
}

std::vector<v1::RenderRequest> Rendering() {
  std::vector<v1::RenderRequest> requests(5);
  requests[0].mutable_settings()->set_tail_s(0.05);
  v1::ContactTraceHeader& header = *requests[1].mutable_record()->mutable_header();
  header.set_format_version(1);
  header.set_step_s(0.01);
  header.mutable_hearing()->set_reference_distance_m(1);
  v1::ContactTraceObject& object = *requests[2].mutable_record()->mutable_object();
  object.set_handle(1);
  object.set_modal_model("modalModels/" + std::string(64, 'a'));
  object.mutable_material()->set_preset("chime_aluminum");
  object.mutable_material()->set_poisson_ratio(0.33);  // that of the model
  v1::ContactStep& step = *requests[3].mutable_record()->mutable_step();
  v1::Contact& impulse = *step.add_contacts();
  impulse.set_kind(v1::CONTACT_KIND_IMPACT);
  impulse.set_object(1);
  impulse.mutable_point_m();
  impulse.mutable_impulse_newton_seconds()->set_x(0.01);
  v1::ContactStep& later = *requests[4].mutable_record()->mutable_step();
  later.set_time_s(0.01);
  v1::ContactColumns& columns = *later.add_contact_columns();
  columns.add_object(1);
  for (const float x : {0.F, 0.F, 0.F}) columns.add_point_m(x);
  for (const float x : {0.01F, 0.F, 0.F}) columns.add_impulse_newton_seconds(x);
  later.mutable_poses()->add_object(1);
  for (const double x : {0.0, 0.0, 1.0}) later.mutable_poses()->add_position_m(x);
  return requests;
}

void WriteTrace() {
  std::string bytes;
  google::protobuf::io::StringOutputStream output(&bytes);
  {
    for (const v1::RenderRequest& request : Rendering()) {
      google::protobuf::util::SerializeDelimitedToZeroCopyStream(request, &output);
    }
  }
  Write("trace", "two_strikes", bytes);
}

void WriteTexts() {
  Write("configuration", "some",
        "listen = [\"unix:/a\", \"127.0.0.1:1\"]\nsample_rate = 44100\ngain = 0.5\ntransfers = "
        "false\n");
  Write("access_file", "two",
        "# who may do what\nann listen,strike sha256:" + std::string(64, '0') +
            "\nbob administer certificate:bob.example\nanybody listen\n");
  Write("texts", "model", "modalModels/" + std::string(64, 'a'));
  Write("texts", "object", "scenes/1/objects/2");
  Write("texts", "plane", "plane:0,0,0/0,0,1");
  Write("texts", "vertices", "vertices:1,2,3");
  Write("texts", "budget", "60:4");
  Write("texts", "length", "3mm");
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  carillon::root = argv[1];
  carillon::WriteMeshes();
  carillon::WriteInterchange();
  carillon::WriteStored();
  carillon::WriteTrace();
  carillon::WriteTexts();
  carillon::WriteRequestSeeds(carillon::root / "request", carillon::Rendering());
}
