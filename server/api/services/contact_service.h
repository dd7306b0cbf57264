// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "carillon/v1/contact_service.grpc.pb.h"
#include "server/api/call/fair_turns.h"
#include "server/api/call/raw_service.h"
#include "server/api/call/reception.h"
#include "server/api/edge/scene_owners.h"
#include "server/api/services/contact_watchers.h"
#include "server/api/services/trace_recorders.h"
#include "server/base/clock.h"
#include "server/live_output/live_output.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// The parts of the daemon that a contact stream uses.
struct ContactContext {
  SceneRegistry& scenes;
  LiveOutput& output;
  Clock& clock;
  SceneOwners& owners;
  Reception reception;
  FairTurns& steps;  ///< parses and takes the messages of the streams
};

/// carillon.v1.ContactService. The objects that the constructor gets by reference must outlive the
/// service.
class ContactService final : public RawService<v1::ContactService> {
 public:
  explicit ContactService(const ContactContext& daemon) : daemon_(daemon) {
    ReadRaw("StreamContacts", &ContactService::StreamContactsRaw);
  }

  grpc::ServerWriteReactor<v1::RecordContactsResponse>* RecordContacts(
      grpc::CallbackServerContext* context, const v1::RecordContactsRequest* request) override;
  grpc::ServerWriteReactor<v1::WatchContactsResponse>* WatchContacts(
      grpc::CallbackServerContext* context, const v1::WatchContactsRequest* request) override;

 private:
  grpc::ServerBidiReactor<grpc::ByteBuffer, v1::StreamContactsResponse>* StreamContactsRaw(
      grpc::CallbackServerContext* context);

  /// Errors: those of SceneOwners::Parse, NotFound (SCENE_NOT_FOUND).
  absl::StatusOr<uint64_t> Find(const grpc::CallbackServerContext& context, const Principal& caller,
                                const std::string& name, SceneCall call) const;

  const ContactContext daemon_;
  TraceRecorders recorders_;
  ContactWatchers watchers_;
};

}  // namespace carillon
