// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/clocked_device.h"

#include <utility>

#include "server/audio_device/realtime_priority.h"

namespace carillon {

ClockedDevice::ClockedDevice(std::string description, const DeviceFormat& format, Clock& clock,
                             Sink sink)
    : description_(std::move(description)),
      format_(format),
      clock_(clock),
      sink_(std::move(sink)) {}

ClockedDevice::~ClockedDevice() { Stop(); }

absl::Status ClockedDevice::Start(FrameSource& source) {
  source_ = &source;
  stopping_ = false;
  thread_ = std::thread([this] { Run(); });
  // A sound card does not wait for other programs. If this thread were kept from running, it would
  // afterwards pull all missed blocks at once, faster than they can be rendered. A refusal is
  // ignored here, because LookAhead makes the same request and reports the refusal.
  MakeRealtime(thread_, Urgency::kRendering).IgnoreError();
  return absl::OkStatus();
}

void ClockedDevice::Stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

absl::Status ClockedDevice::Check() {
  const MutexLock lock(&mutex_);
  return state_;
}

void ClockedDevice::GiveToSink(std::span<const float> block) {
  absl::Status status = sink_(block);
  if (!status.ok()) lost_frame_count_ += format_.block_frame_count;
  const MutexLock lock(&mutex_);
  state_ = std::move(status);
}

void ClockedDevice::Run() {
  std::vector<float> block(format_.block_size());
  const uint64_t frame_count = format_.block_frame_count;
  const std::chrono::nanoseconds start = clock_.Monotonic();
  // Due times are computed from the start, so that rounding errors do not accumulate.
  for (uint64_t frames = frame_count; !stopping_; frames += frame_count) {
    source_->Pull(block);
    if (sink_) GiveToSink(block);
    clock_.SleepUntil(start +
                      std::chrono::nanoseconds(frames * 1'000'000'000 / format_.sample_rate_hz));
  }
}

}  // namespace carillon
