// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/contact.pb.h"
#include "carillon/v1/contact_service.pb.h"

namespace carillon::client {

/// Sends the contacts of a running simulation to a scene. Client::StreamContacts opens a stream.
/// The interface is abstract, so that tests can pass a fake.
///
/// Threads: one thread at a time may call the methods. Send() never waits for the daemon: the
/// threads of the network library do the sending. If Finish() was not called, the destructor
/// cancels the stream and drops the steps that have not been sent.
class ContactStream {
 public:
  /// The largest number of steps that may wait for the network.
  static constexpr size_t kMaxQueuedSteps = 4096;

  virtual ~ContactStream() = default;

  /// Queues one simulation step and returns at once. If the stream has ended, returns the error
  /// that ended it, or FAILED_PRECONDITION (CONTACT_STREAM_ENDED) after Finish(). A step whose time
  /// goes back, or is over 1e10 s before or after 0, is refused with INVALID_ARGUMENT
  /// (INVALID_STREAM) and not sent, and the stream can go on. If kMaxQueuedSteps steps are waiting,
  /// the stream drops and counts the oldest of them, so that the newest are heard.
  virtual absl::Status Send(v1::ContactStep step) = 0;

  /// Returns the number of steps that wait for the network.
  virtual size_t WaitingStepCount() const { return 0; }

  /// Returns the number of steps that were dropped, because too many waited.
  virtual uint64_t DroppedStepCount() const { return 0; }

  /// Returns the newest answer of the daemon: the delays in seconds, counts since the stream was
  /// opened, and warnings. The client adds one, STEPS_DROPPED, if it has dropped steps.
  virtual v1::StreamContactsResponse Report() const = 0;

  /// Sends the steps that are waiting, ends the stream, and returns the daemon's last answer or the
  /// error that ended the stream. Call it once.
  virtual absl::StatusOr<v1::StreamContactsResponse> Finish() = 0;
};

}  // namespace carillon::client
