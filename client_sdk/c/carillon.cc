// SPDX-License-Identifier: Apache-2.0
//
// The C interface over the C++ client: each function converts its arguments, calls the client, and
// keeps the error of its thread.
#include "client_sdk/c/carillon.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "carillon/client.h"
#include "carillon/lasting_stream.h"
#include "client_sdk/c/c_conversion.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/status_macros.h"

struct carillon_client {
  std::unique_ptr<carillon::client::Client> daemon;
};

struct carillon_scene {
  const carillon::client::Client& daemon;
  std::string name;
  std::optional<carillon::client::SceneRegistration> registration = std::nullopt;
};

struct carillon_stream {
  std::unique_ptr<carillon::client::ContactStream> stream;
};

struct carillon_trace {
  carillon::client::ContactTraceWriter writer;
  uint32_t next_handle = 1;
};

namespace {

using carillon::Refusal;
namespace v1 = carillon::v1;

thread_local std::string last_error;
thread_local std::string last_reason;
thread_local std::string last_warnings;

carillon_code Keep(const absl::Status& status) {
  if (status.ok()) return CARILLON_OK;
  last_error = std::string(status.message());
  last_reason = carillon::client::ToErrorInfo(status).reason();
  return static_cast<carillon_code>(status.code());
}

/// Calls `work` and keeps its error. No exception leaves the library.
template <class Work>
carillon_code Try(Work work) {
  try {
    return Keep(work());
  } catch (const std::bad_alloc&) {
    return Keep(Refusal(absl::StatusCode::kResourceExhausted, "OUT_OF_MEMORY",
                        "the memory did not suffice"));
  } catch (const std::exception& error) {
    return Keep(Refusal(absl::StatusCode::kInternal, "INTERNAL", error.what()));
  }
}

absl::Status Missing(const char* what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                 absl::StrCat(what, " is a null pointer"));
}

/// Uploads a mesh and waits for its model.
absl::Status CreateModel(const carillon::client::Client& daemon, const std::string& bytes,
                         v1::CreateModalModelRequest request, char* model) {
  ASSIGN_OR_RETURN(const std::string digest, daemon.UploadMesh(bytes));
  request.set_mesh_digest(digest);
  ASSIGN_OR_RETURN(const v1::Job job, daemon.CreateModalModel(request));
  ASSIGN_OR_RETURN(const v1::Job done, daemon.WatchJob(job.name(), nullptr));
  const std::string& name = done.modal_model();
  if (name.size() >= CARILLON_NAME_SIZE) return absl::InternalError("the name is too long");
  std::copy_n(name.c_str(), name.size() + 1, model);
  return absl::OkStatus();
}

void KeepWarnings(const google::protobuf::RepeatedPtrField<v1::Warning>& warnings) {
  last_warnings = absl::StrJoin(warnings, "\n", [](std::string* text, const v1::Warning& warning) {
    absl::StrAppend(text, warning.id(), ": ", warning.text());
  });
}

absl::StatusOr<carillon_sound> Render(const carillon::client::Client& daemon,
                                      const std::string& file, const v1::RenderSettings& settings) {
  last_warnings.clear();
  ASSIGN_OR_RETURN(auto trace, carillon::client::ContactTraceReader::Open(file));
  std::vector<float> samples;
  carillon_sound sound = {};
  const auto take = [&](const carillon::client::AudioBlock& block) {
    samples.insert(samples.end(), block.samples.begin(), block.samples.end());
    sound.channel_count = block.channel_count;
    sound.sample_rate_hz = block.sample_rate_hz;
    return true;
  };
  ASSIGN_OR_RETURN(const v1::RenderSummary summary, daemon.Render(settings, trace, take));
  KeepWarnings(summary.warnings());
  if (summary.rejected_count() > 0) {
    return Refusal(absl::StatusCode::kInvalidArgument, summary.last_rejection().reason(),
                   summary.last_rejection().message());
  }
  auto owned = std::make_unique<float[]>(samples.size());
  std::ranges::copy(samples, owned.get());
  sound.samples = owned.release();
  sound.frame_count = summary.frame_count();
  return sound;
}

}  // namespace

extern "C" {

const char* carillon_version(void) { return CARILLON_VERSION; }
const char* carillon_error(void) { return last_error.c_str(); }
const char* carillon_error_reason(void) { return last_reason.c_str(); }
const char* carillon_warnings(void) { return last_warnings.c_str(); }

carillon_code carillon_connect(const char* server, carillon_client** client) {
  return Try([&]() -> absl::Status {
    if (client == nullptr) return Missing("client");
    auto daemon = carillon::client::Connect(server == nullptr ? "" : server);
    RETURN_IF_ERROR(daemon->GetMixer().status());
    *client = new carillon_client{std::move(daemon)};
    return absl::OkStatus();
  });
}

void carillon_disconnect(carillon_client* client) { delete client; }

carillon_code carillon_create_model(carillon_client* client, const char* mesh_file,
                                    const char* material, char* model) {
  return Try([&]() -> absl::Status {
    if (!client || !mesh_file || !material || !model) return Missing("an argument");
    const std::filesystem::path path = mesh_file;
    v1::CreateModalModelRequest request;
    request.set_mesh_format(carillon::MeshFormatOf(path));
    ASSIGN_OR_RETURN(const std::string bytes, carillon::ReadMeshFile(path, request.mesh_format()));
    request.mutable_material()->set_preset(material);
    request.set_label(path.stem());
    return CreateModel(*client->daemon, bytes, request, model);
  });
}

carillon_code carillon_create_model_of_mesh(carillon_client* client, const carillon_mesh* mesh,
                                            const char* material, char* model) {
  return Try([&]() -> absl::Status {
    if (!client || !mesh || !mesh->vertices_m || !mesh->triangles || !material || !model) {
      return Missing("an argument");
    }
    ASSIGN_OR_RETURN(const std::string bytes,
                     carillon::c::MakeObj(std::span(mesh->vertices_m, 3 * mesh->vertex_count),
                                          std::span(mesh->triangles, 3 * mesh->triangle_count)));
    v1::CreateModalModelRequest request;
    request.set_mesh_format("obj");
    request.mutable_material()->set_preset(material);
    return CreateModel(*client->daemon, bytes, request, model);
  });
}

carillon_code carillon_create_scene(carillon_client* client, const carillon_hearing* hearing,
                                    carillon_scene** scene) {
  return Try([&]() -> absl::Status {
    if (!client || !scene) return Missing("an argument");
    v1::CreateSceneRequest request;
    carillon::c::Fill(hearing, request);
    ASSIGN_OR_RETURN(const auto created, client->daemon->CreateScene(request));
    *scene = new carillon_scene{*client->daemon, created.name()};
    return absl::OkStatus();
  });
}

carillon_code carillon_register_scene(carillon_client* client,
                                      const carillon_registration* registration,
                                      carillon_scene** scene) {
  return Try([&]() -> absl::Status {
    if (!client || !registration || !registration->id || !scene) return Missing("an argument");
    const auto& [id, hearing, objects, object_count] = *registration;
    if (!objects && object_count > 0) return Missing("the list of objects");
    carillon::client::SceneRegistration made;
    made.scene.set_id(id);
    carillon::c::Fill(hearing, made.scene);
    for (const carillon_object& object : std::span(objects, object_count)) {
      if (!object.model || !object.material) return Missing("the model or material of an object");
      carillon::c::Fill(object, made.objects.emplace_back());
    }
    ASSIGN_OR_RETURN(std::string name, RegisterScene(*client->daemon, made));
    *scene = new carillon_scene{*client->daemon, std::move(name), std::move(made)};
    return absl::OkStatus();
  });
}

void carillon_delete_scene(carillon_scene* scene) {
  if (scene == nullptr) return;
  const std::unique_ptr<carillon_scene> owned(scene);
  Try([&] { return scene->daemon.DeleteScene(scene->name); });
}

const char* carillon_scene_name(const carillon_scene* scene) {
  return scene == nullptr ? "" : scene->name.c_str();
}

carillon_code carillon_add_object(carillon_scene* scene, const carillon_object* object,
                                  uint32_t* handle) {
  return Try([&]() -> absl::Status {
    if (!scene || !object || !object->model || !object->material) return Missing("an argument");
    v1::AddObjectsRequest request;
    request.set_scene(scene->name);
    carillon::c::Fill(*object, *request.add_objects());
    ASSIGN_OR_RETURN(const auto added, scene->daemon.AddObjects(request));
    if (handle != nullptr) *handle = added.front().handle();
    return absl::OkStatus();
  });
}

carillon_code carillon_remove_object(carillon_scene* scene, uint32_t handle) {
  return Try([&]() -> absl::Status {
    if (!scene) return Missing("scene");
    return scene->daemon.RemoveObject(absl::StrCat(scene->name, "/objects/", handle));
  });
}

carillon_code carillon_set_gain(carillon_scene* scene, double gain) {
  return Try([&]() -> absl::Status {
    if (!scene) return Missing("scene");
    v1::UpdateSceneRequest request;
    request.set_name(scene->name);
    request.set_gain(gain);
    return scene->daemon.UpdateScene(request).status();
  });
}

carillon_code carillon_stop(carillon_scene* scene) {
  return Try([&]() -> absl::Status {
    if (!scene) return Missing("scene");
    return scene->daemon.StopAll(scene->name).status();
  });
}

carillon_code carillon_open_stream(carillon_scene* scene, double step_s, carillon_frame frame,
                                   carillon_stream** stream) {
  return Try([&]() -> absl::Status {
    if (!scene || !stream) return Missing("an argument");
    v1::ContactStreamStart start;
    start.set_scene(scene->name);
    start.set_step_s(step_s);
    ASSIGN_OR_RETURN(const v1::Frame given, carillon::c::ToFrame(frame));
    start.set_frame(given);
    auto opened = scene->registration
                      ? OpenLastingStream(scene->daemon, *scene->registration, start)
                      : scene->daemon.StreamContacts(start);
    RETURN_IF_ERROR(opened.status());
    *stream = new carillon_stream{*std::move(opened)};
    return absl::OkStatus();
  });
}

carillon_code carillon_send(carillon_stream* stream, const carillon_step* step) {
  return Try([&]() -> absl::Status {
    if (!stream || !step) return Missing("an argument");
    ASSIGN_OR_RETURN(v1::ContactStep made, carillon::c::ToStep(*step));
    return stream->stream->Send(std::move(made));
  });
}

carillon_code carillon_close_stream(carillon_stream* stream, carillon_report* report) {
  if (stream == nullptr) return CARILLON_OK;
  const std::unique_ptr<carillon_stream> owned(stream);
  return Try([&]() -> absl::Status {
    last_warnings.clear();
    ASSIGN_OR_RETURN(const v1::StreamContactsResponse last, stream->stream->Finish());
    KeepWarnings(last.warnings());
    if (report == nullptr) return absl::OkStatus();
    *report = {.step_count = last.step_count(),
               .accepted_count = last.accepted_count(),
               .late_count = last.late_count(),
               .rejected_count = last.rejected_count(),
               .dropped_step_count = stream->stream->DroppedStepCount()};
    return absl::OkStatus();
  });
}

carillon_code carillon_create_trace(const char* file, double step_s, carillon_frame frame,
                                    const carillon_hearing* hearing, carillon_trace** trace) {
  return Try([&]() -> absl::Status {
    if (!file || !trace) return Missing("an argument");
    RETURN_IF_ERROR(carillon::c::CheckStep(step_s));
    v1::ContactTraceHeader header;
    header.set_step_s(step_s);
    ASSIGN_OR_RETURN(const v1::Frame given, carillon::c::ToFrame(frame));
    header.set_frame(given);
    carillon::c::Fill(hearing, header);
    ASSIGN_OR_RETURN(auto writer, carillon::client::ContactTraceWriter::Create(file, header));
    *trace = new carillon_trace{std::move(writer)};
    return absl::OkStatus();
  });
}

carillon_code carillon_trace_object(carillon_trace* trace, const carillon_object* object,
                                    uint32_t* handle) {
  return Try([&]() -> absl::Status {
    if (!trace || !object || !object->model || !object->material) return Missing("an argument");
    v1::ContactTraceObject written;
    carillon::c::Fill(*object, written);
    if (object->handle == 0) written.set_handle(trace->next_handle);
    trace->next_handle = std::max(trace->next_handle, written.handle() + 1);
    trace->writer.Write(written);
    if (handle != nullptr) *handle = written.handle();
    return absl::OkStatus();
  });
}

carillon_code carillon_trace_step(carillon_trace* trace, const carillon_step* step) {
  return Try([&]() -> absl::Status {
    if (!trace || !step) return Missing("an argument");
    ASSIGN_OR_RETURN(const v1::ContactStep made, carillon::c::ToStep(*step));
    return trace->writer.Write(made);
  });
}

carillon_code carillon_close_trace(carillon_trace* trace) {
  if (trace == nullptr) return CARILLON_OK;
  const std::unique_ptr<carillon_trace> owned(trace);
  return Try([&] { return trace->writer.Close(); });
}

carillon_code carillon_render(carillon_client* client, const char* trace_file,
                              const carillon_render_settings* settings, carillon_sound* sound) {
  return Try([&]() -> absl::Status {
    if (!client || !trace_file || !sound) return Missing("an argument");
    v1::RenderSettings wanted;
    if (settings != nullptr) {
      wanted.set_sample_rate_hz(settings->sample_rate_hz);
      wanted.set_channel_count(settings->channel_count);
      wanted.set_tail_s(settings->tail_s);
    }
    ASSIGN_OR_RETURN(*sound, Render(*client->daemon, trace_file, wanted));
    return absl::OkStatus();
  });
}

void carillon_free_sound(carillon_sound* sound) {
  if (sound == nullptr) return;
  delete[] sound->samples;
  *sound = {};
}

}  // extern "C"
