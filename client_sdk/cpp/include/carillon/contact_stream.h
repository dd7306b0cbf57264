// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "carillon/v1/contact_service.pb.h"

namespace carillon::client {

/// Contacts on their way to a scene while a simulation runs; Client::StreamContacts opens one.
/// One thread sends; the network's work is done by gRPC's own threads, so a step never waits for
/// the daemon. Destroying an unfinished stream abandons what is still queued.
class ContactStream {
 public:
  /// Steps that may wait for the network.
  static constexpr size_t kMaxQueuedSteps = 4096;

  virtual ~ContactStream() = default;

  /// Queues one simulation step and returns at once. Errors: what ended the stream, or
  /// RESOURCE_EXHAUSTED (CONTACT_QUEUE_FULL), and the step is lost.
  virtual absl::Status Send(v1::ContactStep step) = 0;

  /// The newest answer: delays, and counts since the start.
  virtual v1::StreamContactsResponse Report() const = 0;

  /// Sends what is queued, ends the stream and returns the daemon's last answer. Call it once.
  virtual absl::StatusOr<v1::StreamContactsResponse> Finish() = 0;
};

}  // namespace carillon::client
