// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/worker_events.h"

#include <google/protobuf/io/coded_stream.h>

#include "proto/cpp/error_reason.h"

namespace carillon {
namespace {

constexpr size_t kMaxVarintBytes = 5;

absl::Status Garbage() {
  return Refusal(
      absl::StatusCode::kDataLoss, "WORKER_CRASHED",
      "the decomposing process has a fault: it wrote what is no event to its event pipe; "
      "report this with the mesh");
}

}  // namespace

absl::Status WorkerEventReader::Feed(
    std::string_view bytes, absl::FunctionRef<void(const worker::v1::WorkerEvent&)> on_event) {
  pending_.append(bytes);
  size_t begin = 0;
  while (begin < pending_.size()) {
    google::protobuf::io::CodedInputStream in(
        reinterpret_cast<const uint8_t*>(pending_.data()) + begin,
        static_cast<int>(pending_.size() - begin));
    uint32_t size = 0;
    if (!in.ReadVarint32(&size)) {
      if (pending_.size() - begin >= kMaxVarintBytes) return Garbage();
      break;
    }
    if (size > kMaxEventBytes) return Garbage();
    const size_t body = begin + static_cast<size_t>(in.CurrentPosition());
    if (pending_.size() - body < size) break;
    worker::v1::WorkerEvent event;
    if (!event.ParseFromArray(pending_.data() + body, static_cast<int>(size)) ||
        event.event_case() == worker::v1::WorkerEvent::EVENT_NOT_SET) {
      return Garbage();
    }
    on_event(event);
    begin = body + size;
  }
  pending_.erase(0, begin);
  return absl::OkStatus();
}

}  // namespace carillon
