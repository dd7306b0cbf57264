// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/look_ahead.h"

#include <chrono>
#include <utility>

#include "server/audio_device/realtime_priority.h"

namespace carillon {

LookAhead::LookAhead(const DeviceFormat& format, uint32_t block_count, RenderBlock render,
                     Clock& clock)
    : format_(format),
      block_count_(block_count),
      render_(std::move(render)),
      clock_(clock),
      rendered_(format, block_count) {}

LookAhead::~LookAhead() { Stop(); }

absl::Status LookAhead::Start() {
  stopping_ = false;
  FillUp();
  thread_ = std::thread([this] { Run(); });
  return MakeRealtime(thread_, Urgency::kRendering);
}

void LookAhead::Stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

double LookAhead::latency_s() const {
  return static_cast<double>(block_count_) * format_.block_frame_count / format_.sample_rate_hz;
}

void LookAhead::Run() {
  const auto half_block =
      std::chrono::nanoseconds(500'000'000ULL * format_.block_frame_count / format_.sample_rate_hz);
  while (!stopping_) {
    FillUp();
    clock_.SleepUntil(clock_.Monotonic() + half_block);
  }
}

void LookAhead::FillUp() {
  while (rendered_.frames().free_count() >= format_.block_size() && !stopping_) RenderOne();
}

void LookAhead::RenderOne() {
  const std::chrono::nanoseconds start = clock_.Monotonic();
  const std::span<float> block = rendered_.frames().Next(format_.block_size());
  render_(block);
  const std::chrono::duration<double> taken = clock_.Monotonic() - start;
  rendered_.frames().Commit(block.size());
  const double block_s = static_cast<double>(format_.block_frame_count) / format_.sample_rate_hz;
  const double old_load = load();
  load_.store(old_load + block_s * (taken.count() / block_s - old_load), std::memory_order_relaxed);
}

}  // namespace carillon
