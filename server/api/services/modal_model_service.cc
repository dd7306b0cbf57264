// SPDX-License-Identifier: Apache-2.0
#include "server/api/services/modal_model_service.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/region_properties.h"
#include "proto/cpp/status_macros.h"
#include "server/api/call/unary_call.h"
#include "server/api/convert/object_conversion.h"
#include "server/api/convert/resource_name.h"
#include "server/api/services/model_streams.h"
#include "server/decomposition/job/stored_model.h"
#include "server/scene/sounding_object.h"

namespace carillon {
namespace {

ModelFilter FilterOf(const v1::ListModalModelsRequest& request) {
  ModelFilter filter{.label_contains = request.label_contains(),
                     .tag = request.tag(),
                     .min_stored_bytes = static_cast<int64_t>(request.min_stored_bytes()),
                     .created_since_unix_ms = request.created_since_unix_ms()};
  if (request.max_stored_bytes() > 0) {
    filter.max_stored_bytes = static_cast<int64_t>(request.max_stored_bytes());
  }
  if (request.created_before_unix_ms() > 0) {
    filter.created_before_unix_ms = request.created_before_unix_ms();
  }
  return filter;
}

absl::string_view NameOf(v1::JobState state) {
  absl::string_view name = v1::JobState_Name(state);
  absl::ConsumePrefix(&name, "JOB_STATE_");
  return name;
}

/// The event for a job that was requested. A job may have ended before, with success or not.
Event SubmittedEvent(const v1::Job& job) {
  return Event("job_submitted")
      .With("job", job.name())
      .WithSome("label", job.label())
      .With("state", absl::AsciiStrToLower(NameOf(job.state())));
}

/// The event for a model that was changed, with the wanted changes.
Event Updated(const v1::UpdateModalModelRequest& request) {
  Event event("model_updated");
  event.With("model", request.name());
  if (request.has_label()) event.With("label", request.label());
  if (request.has_pinned()) event.With("pinned", request.pinned() ? "true" : "false");
  if (request.has_material()) {
    const std::string& preset = request.material().preset();
    event.With("material", preset.empty() ? "without_preset" : preset);
  }
  return event.WithSome("add_tags", absl::StrJoin(request.add_tags(), ","))
      .WithSome("remove_tags", absl::StrJoin(request.remove_tags(), ","));
}

}  // namespace

grpc::ServerReadReactor<grpc::ByteBuffer>* ModalModelService::UploadMeshRaw(
    grpc::CallbackServerContext* context, v1::UploadMeshResponse* response) {
  return Open(*context, daemon_.writing, {Role::kSubmit, Holding::kUpload},
              [&](const Principal& caller, ClientPlace place) {
                const auto on_stored = [&events = daemon_.writing.events,
                                        caller](const Event& event) {
                  events.LogLimited(event, caller);
                };
                return MakeUpload(*context, *response, {database_.meshes(), on_stored},
                                  daemon_.writing.pool, BoundsOf(std::move(place)));
              });
}

grpc::ServerUnaryReactor* ModalModelService::CreateModalModel(
    grpc::CallbackServerContext* context, const v1::CreateModalModelRequest* request,
    v1::CreateModalModelResponse* response) {
  return Answer(
      context, daemon_.writing, Role::kSubmit, [this, request, response](const Principal& caller) {
        const auto check = [&](const std::string& model, const v1::Material& material) {
          return MayRemember(model, material, caller);
        };
        ASSIGN_OR_RETURN(*response->mutable_job(), queue_.Submit(*request, caller.client, check,
                                                                 caller.has(Role::kAdminister)));
        daemon_.writing.events.LogLimited(SubmittedEvent(response->job()), caller);
        return absl::OkStatus();
      });
}

grpc::ServerUnaryReactor* ModalModelService::CreateTransfer(
    grpc::CallbackServerContext* context, const v1::CreateTransferRequest* request,
    v1::CreateTransferResponse* response) {
  return Answer(
      context, daemon_.writing, Role::kSubmit, [this, request, response](const Principal& caller) {
        ASSIGN_OR_RETURN(const std::string digest, ParseModelName(request->modal_model()));
        v1::CreateTransferRequest whole = *request;
        ASSIGN_OR_RETURN(*whole.mutable_material(),
                         MaterialOrModels(request->material(), digest, database_.models()));
        RETURN_IF_ERROR(TakeReference(digest, *whole.mutable_material()));
        ASSIGN_OR_RETURN(
            *response->mutable_job(),
            queue_.SubmitTransfer(digest, whole, caller.client, caller.has(Role::kAdminister)));
        daemon_.writing.events.LogLimited(
            SubmittedEvent(response->job()).With("transfer_of", request->modal_model()), caller);
        return absl::OkStatus();
      });
}

grpc::ServerUnaryReactor* ModalModelService::GetModalModel(grpc::CallbackServerContext* context,
                                                           const v1::GetModalModelRequest* request,
                                                           v1::GetModalModelResponse* response) {
  return Answer(context, daemon_.reception, Role::kAny,
                [this, request, response] { return Get(*request, *response); });
}

grpc::ServerUnaryReactor* ModalModelService::ListModalModels(
    grpc::CallbackServerContext* context, const v1::ListModalModelsRequest* request,
    v1::ListModalModelsResponse* response) {
  return Answer(context, daemon_.reception, Role::kAny,
                [this, request, response] { return List(*request, *response); });
}

grpc::ServerUnaryReactor* ModalModelService::UpdateModalModel(
    grpc::CallbackServerContext* context, const v1::UpdateModalModelRequest* request,
    v1::UpdateModalModelResponse* response) {
  return Answer(context, daemon_.writing, Role::kSubmit,
                [this, request, response](const Principal& caller) {
                  RETURN_IF_ERROR(Update(*request, caller, *response));
                  daemon_.writing.events.LogLimited(Updated(*request), caller);
                  return absl::OkStatus();
                });
}

grpc::ServerUnaryReactor* ModalModelService::DeleteModalModel(
    grpc::CallbackServerContext* context, const v1::DeleteModalModelRequest* request,
    v1::DeleteModalModelResponse*) {
  return Answer(
      context, daemon_.writing, Role::kAdminister, [this, request](const Principal& caller) {
        ASSIGN_OR_RETURN(const std::string digest, ParseModelName(request->name()));
        RETURN_IF_ERROR(queue_.DeleteModel(digest));
        daemon_.writing.events.Log(Event("model_deleted").With("model", ModelName(digest)), caller);
        return absl::OkStatus();
      });
}

grpc::ServerReadReactor<grpc::ByteBuffer>* ModalModelService::ImportModalModelRaw(
    grpc::CallbackServerContext* context, v1::ImportModalModelResponse* response) {
  return Open(*context, daemon_.writing, {Role::kSubmit, Holding::kUpload},
              [&](const Principal& caller, ClientPlace place) {
                const auto on_stored = [&events = daemon_.writing.events,
                                        caller](const Event& event) {
                  events.LogLimited(event, caller);
                };
                // Who may delete a model may also replace it.
                const Replacing replacing =
                    caller.has(Role::kAdminister) ? Replacing::kUnlessPinned : Replacing::kNever;
                return MakeImport(*context, *response, {database_, replacing, on_stored},
                                  daemon_.writing.pool, BoundsOf(std::move(place)));
              });
}

grpc::ServerWriteReactor<v1::ExportModalModelResponse>* ModalModelService::ExportModalModel(
    grpc::CallbackServerContext* context, const v1::ExportModalModelRequest* request) {
  return Open(*context, daemon_.reception, {Role::kSubmit, Holding::kExport},
              [&](const Principal&, ClientPlace place) {
                return MakeExport(*context, *request, database_, daemon_.reception.pool,
                                  BoundsOf(std::move(place)));
              });
}

grpc::ServerWriteReactor<v1::GetShapesResponse>* ModalModelService::GetShapes(
    grpc::CallbackServerContext* context, const v1::GetShapesRequest* request) {
  return Open(*context, daemon_.reception, {Role::kSubmit, Holding::kExport},
              [&](const Principal&, ClientPlace place) {
                return MakeShapes(*context, *request, database_, daemon_.reception.pool,
                                  BoundsOf(std::move(place)));
              });
}

grpc::ServerUnaryReactor* ModalModelService::ListMaterials(grpc::CallbackServerContext* context,
                                                           const v1::ListMaterialsRequest*,
                                                           v1::ListMaterialsResponse* response) {
  return Answer(context, daemon_.reception, Role::kAny, [response] {
    *response->mutable_materials() = Materials().materials();
    return absl::OkStatus();
  });
}

CallBounds ModalModelService::BoundsOf(ClientPlace place) const {
  return {.place = std::move(place), .idle_calls = daemon_.idle_calls, .clock = daemon_.clock};
}

absl::Status ModalModelService::Get(const v1::GetModalModelRequest& request,
                                    v1::GetModalModelResponse& response) {
  ASSIGN_OR_RETURN(const std::string digest, ParseModelName(request.name()));
  ASSIGN_OR_RETURN(const std::vector<double> eigenvalues, database_.models().Eigenvalues(digest));
  ASSIGN_OR_RETURN(const ModelSummary summary, database_.models().Summary(digest));
  *response.mutable_modal_model() = ToProto(summary);
  response.mutable_modal_model()->mutable_eigenvalues()->Add(eigenvalues.begin(),
                                                             eigenvalues.end());
  ASSIGN_OR_RETURN(const auto transfers, database_.transfers().List(digest));
  ASSIGN_OR_RETURN(const std::vector<StoredTransfer> stored, database_.transfers().Read(digest));
  for (const TransferSummary& transfer : transfers) {
    v1::TransferSummary& proto = *response.mutable_modal_model()->add_transfers();
    *proto.mutable_header() = transfer.header;
    proto.set_stored_bytes(transfer.stored_bytes);
    proto.set_created_unix_ms(transfer.created_unix_ms);
    const auto same = std::ranges::find_if(stored, [&](const StoredTransfer& one) {
      return one.header().speed_ratio() == transfer.header.speed_ratio();
    });
    if (same == stored.end()) continue;
    const std::vector<float> integrals = same->Decode().power_integrals;
    proto.mutable_power_integrals()->Add(integrals.begin(), integrals.end());
  }
  return absl::OkStatus();
}

// Objects that name no material would all be refused with a material that does not fit the model.
absl::Status ModalModelService::CheckMaterial(const v1::Material& material,
                                              const std::string& digest) {
  ASSIGN_OR_RETURN(const ObjectProperties properties, ToObjectProperties(material, 1, 1));
  ASSIGN_OR_RETURN(const auto model, database_.models().Find(digest));
  return CheckSounds(*model, properties, daemon_.sample_rate_hz, &database_.transfers());
}

absl::Status ModalModelService::TakeReference(const std::string& digest, v1::Material& material) {
  const absl::StatusOr<ModelSummary> model = database_.models().Summary(digest);
  if (!model.ok() || (material.regions().empty() && model->header.regions().empty())) {
    return absl::OkStatus();  // the queue says why there is no model
  }
  ASSIGN_OR_RETURN(const v1::Material resolved, ResolveMaterial(material));
  ASSIGN_OR_RETURN(material, MatchRegions(model->header, resolved));
  return absl::OkStatus();
}

// Another request for a stored model does not take away a material with which its objects sound.
bool ModalModelService::MayRemember(const std::string& digest, const v1::Material& material,
                                    const Principal& caller) {
  if (!CheckPin(database_.models(), digest, caller.has(Role::kAdminister)).ok()) return false;
  const auto known = database_.models().Material(digest);
  if (!known.ok() || !known->has_value()) return true;
  // A request that is repeated does not read the model.
  if ((*known)->SerializeAsString() == material.SerializeAsString()) return true;
  if (!absl::IsFailedPrecondition(CheckMaterial(material, digest))) return true;
  return !CheckMaterial(**known, digest).ok();
}

absl::Status ModalModelService::Update(const v1::UpdateModalModelRequest& request,
                                       const Principal& caller,
                                       v1::UpdateModalModelResponse& response) {
  ASSIGN_OR_RETURN(const std::string digest, ParseModelName(request.name()));
  RETURN_IF_ERROR(CheckPin(database_.models(), digest, caller.has(Role::kAdminister)));
  ModelChange change{.add_tags = {request.add_tags().begin(), request.add_tags().end()},
                     .remove_tags = {request.remove_tags().begin(), request.remove_tags().end()}};
  if (request.has_label()) change.label = request.label();
  if (request.has_pinned()) change.pinned = request.pinned();
  if (request.has_material()) {
    RETURN_IF_ERROR(CheckMaterial(request.material(), digest));
    change.material = request.material();
  }
  ASSIGN_OR_RETURN(const ModelSummary summary, database_.models().Update(digest, change));
  *response.mutable_modal_model() = ToProto(summary);
  return absl::OkStatus();
}

absl::Status ModalModelService::List(const v1::ListModalModelsRequest& request,
                                     v1::ListModalModelsResponse& response) {
  ASSIGN_OR_RETURN(
      const ModelPage page,
      database_.models().List(FilterOf(request), request.page_size(), request.page_token()));
  for (const ModelSummary& summary : page.models) *response.add_modal_models() = ToProto(summary);
  response.set_next_page_token(page.next_page_token);
  return absl::OkStatus();
}

}  // namespace carillon
