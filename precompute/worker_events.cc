// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/worker_events.h"

#include <google/protobuf/util/delimited_message_util.h>

#include "carillon/v1/decomposition.pb.h"
#include "proto/cpp/error_reason.h"

namespace carillon::precompute {
namespace {

void Send(int descriptor, const v1::WorkerEvent& event) {
  if (descriptor < 0) return;
  google::protobuf::util::SerializeDelimitedToFileDescriptor(event, descriptor);
}

}  // namespace

void WorkerEvents::SendProgress(const ProgressState& state) const {
  v1::WorkerEvent event;
  v1::Progress& progress = *event.mutable_progress();
  progress.set_phase(static_cast<v1::Phase>(static_cast<int>(state.phase) + v1::PHASE_READ));
  progress.set_fraction(state.fraction);
  progress.set_remaining_s(state.remaining_s.value_or(0));
  progress.set_node_count(static_cast<uint32_t>(state.node_count));
  progress.set_converged_mode_count(static_cast<uint32_t>(state.mode_count));
  Send(descriptor_, event);
}

void WorkerEvents::SendError(const absl::Status& status) const {
  v1::WorkerEvent event;
  *event.mutable_error() = ToErrorInfo(status);
  Send(descriptor_, event);
}

}  // namespace carillon::precompute
