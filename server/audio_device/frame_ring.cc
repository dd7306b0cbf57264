// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/frame_ring.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <new>

#include "proto/cpp/error_reason.h"

namespace carillon {

/// The beginning of the memory; the samples follow.
struct FrameRing::Head {
  Head(size_t samples, uint32_t channels) : sample_count(samples), channel_count(channels) {}

  const size_t sample_count;  ///< capacity
  const uint32_t channel_count;
  RingCounts counts;
  std::atomic<uint64_t> xrun_count{0};
  std::atomic<uint64_t> lost_frame_count{0};

  size_t byte_count() const { return sizeof(Head) + sample_count * sizeof(float); }
  std::span<float> samples() { return {reinterpret_cast<float*>(this + 1), sample_count}; }
};

namespace {

void* MapShared(int descriptor, size_t byte_count) {
  return mmap(nullptr, byte_count, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, descriptor,
              0);
}

/// Memory for `byte_count` bytes. Throws std::bad_alloc, as any container does, if there is none.
int MakeMemory(size_t byte_count) {
  const int descriptor = memfd_create("carillon frames", MFD_CLOEXEC);
  if (descriptor < 0 || ftruncate(descriptor, static_cast<off_t>(byte_count)) != 0) {
    throw std::bad_alloc();
  }
  return descriptor;
}

size_t ByteCount(int descriptor) {
  struct stat status {};
  return fstat(descriptor, &status) == 0 ? static_cast<size_t>(status.st_size) : 0;
}

}  // namespace

FrameRing::FrameRing(const DeviceFormat& format, uint32_t block_count)
    : descriptor_(MakeMemory(sizeof(Head) + block_count * format.block_size() * sizeof(float))),
      head_(*[&] {
        void* memory = MapShared(descriptor_, ByteCount(descriptor_));
        if (memory == MAP_FAILED) throw std::bad_alloc();
        return new (memory) Head(block_count * format.block_size(), format.channel_count);
      }()),
      frames_(head_.samples(), head_.counts) {}

FrameRing::FrameRing(int descriptor, Head& head)
    : descriptor_(descriptor), head_(head), frames_(head.samples(), head.counts) {}

absl::StatusOr<std::unique_ptr<FrameRing>> FrameRing::Map(int descriptor) {
  const size_t byte_count = ByteCount(descriptor);
  void* const memory = byte_count < sizeof(Head) ? MAP_FAILED : MapShared(descriptor, byte_count);
  if (memory == MAP_FAILED || static_cast<Head*>(memory)->byte_count() != byte_count) {
    return Refusal(absl::StatusCode::kInternal, "AUDIO_DEVICE_FAILED",
                   "the memory of the rendered frames cannot be mapped");
  }
  return std::unique_ptr<FrameRing>(new FrameRing(descriptor, *static_cast<Head*>(memory)));
}

FrameRing::~FrameRing() {
  munmap(&head_, head_.byte_count());
  close(descriptor_);
}

void FrameRing::Pull(std::span<float> frames) noexcept {
  const size_t ready = frames_.Pop(frames);
  if (ready == frames.size()) return;
  std::ranges::fill(frames.subspan(ready), 0.0F);
  head_.xrun_count.fetch_add(1, std::memory_order_relaxed);
  head_.lost_frame_count.fetch_add((frames.size() - ready) / head_.channel_count,
                                   std::memory_order_relaxed);
}

uint64_t FrameRing::xrun_count() const { return head_.xrun_count.load(std::memory_order_relaxed); }

uint64_t FrameRing::lost_frame_count() const {
  return head_.lost_frame_count.load(std::memory_order_relaxed);
}

}  // namespace carillon
