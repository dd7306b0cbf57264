// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/console/gateway/tunnel_call.h"

#include <grpcpp/support/slice.h>

#include <utility>
#include <vector>

namespace carillon::console {
namespace {

std::string BytesOf(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (!buffer.Dump(&slices).ok()) return bytes;
  bytes.reserve(buffer.Length());
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

}  // namespace

std::shared_ptr<TunnelCall> TunnelCall::Start(const std::shared_ptr<grpc::Channel>& channel,
                                              const std::string& method, const std::string& token,
                                              Callbacks callbacks) {
  std::shared_ptr<TunnelCall> call(new TunnelCall(std::move(callbacks)));
  call->self_ = call;
  if (!token.empty()) call->context_.AddMetadata("authorization", "Bearer " + token);
  call->stub_ = std::make_unique<grpc::GenericStub>(channel);
  call->stub_->PrepareBidiStreamingCall(&call->context_, method, grpc::StubOptions(), call.get());
  // Send(), HalfClose() and ReadNext() start operations outside the callbacks, which needs a hold.
  call->AddHold();
  call->ReadNext();
  call->StartCall();
  return call;
}

void TunnelCall::Send(std::string_view bytes) {
  grpc::Slice slice(bytes.data(), bytes.size());
  const absl::MutexLock lock(&mutex_);
  if (over_ || half_close_wanted_) return;
  outgoing_.emplace_back(&slice, 1);
  waiting_bytes_ += bytes.size();
  WriteNext();
}

void TunnelCall::HalfClose() {
  const absl::MutexLock lock(&mutex_);
  if (over_) return;
  half_close_wanted_ = true;
  WriteNext();
}

void TunnelCall::Cancel() {
  context_.TryCancel();
  // A call that is not being read learns of its end by the next read only.
  ReadNext();
}

void TunnelCall::ReadNext() {
  const absl::MutexLock lock(&mutex_);
  if (over_ || reading_) return;
  reading_ = true;
  StartRead(&incoming_);
}

size_t TunnelCall::WaitingBytes() const {
  const absl::MutexLock lock(&mutex_);
  return waiting_bytes_;
}

void TunnelCall::OnReadDone(bool ok) {
  {
    const absl::MutexLock lock(&mutex_);
    reading_ = false;
    over_ = !ok;
  }
  if (ok) {
    callbacks_.on_message(BytesOf(incoming_));
  } else {
    RemoveHold();
  }
}

void TunnelCall::OnWriteDone(bool ok) {
  const absl::MutexLock lock(&mutex_);
  writing_ = false;
  waiting_bytes_ -= outgoing_.front().Length();
  outgoing_.pop_front();
  if (ok && !over_) WriteNext();
}

void TunnelCall::OnDone(const grpc::Status& status) {
  // The callback may let go of the call, and of itself.
  const auto on_end = std::move(callbacks_.on_end);
  on_end(status, std::move(self_));
}

void TunnelCall::WriteNext() {
  if (writing_) return;
  if (!outgoing_.empty()) {
    writing_ = true;
    StartWrite(&outgoing_.front());
  } else if (half_close_wanted_ && !half_closed_) {
    half_closed_ = true;
    StartWritesDone();
  }
}

}  // namespace carillon::console
