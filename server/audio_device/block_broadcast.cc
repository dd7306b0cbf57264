// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/block_broadcast.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"

namespace carillon {

BlockBroadcast::Listener::Listener(BlockBroadcast& broadcast, std::function<void()> wake)
    : broadcast_(broadcast), wake_(std::move(wake)) {}

BlockBroadcast::Listener::~Listener() { broadcast_.Remove(this); }

std::shared_ptr<const RenderedBlock> BlockBroadcast::Listener::TryTake() {
  const MutexLock lock(&mutex_);
  if (queue_.empty()) return nullptr;
  std::shared_ptr<const RenderedBlock> block = std::move(queue_.front());
  queue_.pop_front();
  return block;
}

bool BlockBroadcast::Listener::ended() const {
  const MutexLock lock(&mutex_);
  return ended_;
}

uint64_t BlockBroadcast::Listener::lost_frame_count() const {
  const MutexLock lock(&mutex_);
  return lost_frame_count_;
}

void BlockBroadcast::Listener::Offer(const std::shared_ptr<const RenderedBlock>& block,
                                     size_t queue_limit) {
  const MutexLock lock(&mutex_);
  lost_frame_count_ += block->first_frame - next_frame_.value_or(block->first_frame);
  const uint32_t frame_count = broadcast_.format_.block_frame_count;
  next_frame_ = block->first_frame + frame_count;
  if (queue_.size() < queue_limit) {
    queue_.push_back(block);
  } else {
    lost_frame_count_ += frame_count;
  }
}

BlockBroadcast::BlockBroadcast(const DeviceFormat& format, size_t queue_block_count)
    : format_(format),
      queue_block_count_(queue_block_count),
      samples_(format.block_size() * queue_block_count),
      first_frames_(queue_block_count) {}

void BlockBroadcast::Publish(uint64_t first_frame, std::span<const float> block) noexcept {
  if (first_frames_.free_count() == 0) return;
  samples_.Push(block);
  first_frames_.Push({&first_frame, 1});
}

void BlockBroadcast::Deliver(absl::FunctionRef<void(const RenderedBlock&)> observe) {
  const MutexLock lock(&mutex_);
  bool any = false;
  while (const std::shared_ptr<const RenderedBlock> block = TryTakePublished()) {
    for (Listener* listener : listeners_) listener->Offer(block, queue_block_count_);
    observe(*block);
    any = true;
  }
  if (!any) return;
  for (Listener* listener : listeners_) listener->wake_();
}

absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> BlockBroadcast::Subscribe(
    std::function<void()> wake) {
  const MutexLock lock(&mutex_);
  if (listeners_.size() >= kMaxListenerCount) {
    return Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_CALLS",
                   absl::StrCat(kMaxListenerCount,
                                " clients listen already; end one of their Listen calls first"));
  }
  std::unique_ptr<Listener> listener(new Listener(*this, std::move(wake)));
  listeners_.push_back(listener.get());
  return listener;
}

void BlockBroadcast::End() {
  const MutexLock lock(&mutex_);
  for (Listener* listener : listeners_) {
    {
      const MutexLock listener_lock(&listener->mutex_);
      listener->ended_ = true;
    }
    listener->wake_();
  }
}

size_t BlockBroadcast::listener_count() const {
  const MutexLock lock(&mutex_);
  return listeners_.size();
}

void BlockBroadcast::Remove(Listener* listener) {
  const MutexLock lock(&mutex_);
  std::erase(listeners_, listener);
}

std::shared_ptr<const RenderedBlock> BlockBroadcast::TryTakePublished() {
  auto block = std::make_shared<RenderedBlock>();
  if (first_frames_.Pop({&block->first_frame, 1}) == 0) return nullptr;
  block->samples.resize(format_.block_size());
  samples_.Pop(block->samples);
  return block;
}

}  // namespace carillon
