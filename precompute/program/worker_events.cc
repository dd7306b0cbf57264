// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/program/worker_events.h"

#include <google/protobuf/util/delimited_message_util.h>

#include "carillon/worker/v1/worker.pb.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

void Send(int descriptor, const worker::v1::WorkerEvent& event) {
  if (descriptor < 0) return;
  google::protobuf::util::SerializeDelimitedToFileDescriptor(event, descriptor);
}

}  // namespace

void WorkerEvents::SendProgress(const v1::Progress& progress) const {
  worker::v1::WorkerEvent event;
  *event.mutable_progress() = progress;
  Send(descriptor_, event);
}

void WorkerEvents::SendError(const absl::Status& status) const {
  worker::v1::WorkerEvent event;
  *event.mutable_error() = ToErrorInfo(status);
  Send(descriptor_, event);
}

}  // namespace carillon::precompute
