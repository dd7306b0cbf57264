// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/live_output.h"

#include <algorithm>
#include <utility>

#include "proto/cpp/status_macros.h"
#include "server/audio_device/realtime_priority.h"
#include "server/synthesis/flush_denormals.h"

namespace carillon {
namespace {

constexpr std::chrono::milliseconds kHousekeepingPeriod(20);
constexpr std::chrono::milliseconds kPausePeriod(100);
/// Peak and loudness are sampled every kLevelPeriod. The peak is the maximum over kPeakMemory.
constexpr std::chrono::milliseconds kLevelPeriod(50);
constexpr std::chrono::seconds kPeakMemory(1);
constexpr std::chrono::seconds kLossPeriod(1);
/// A fade takes 50 ms and the latency of the device. A device that is stuck must not delay a stop.
constexpr std::chrono::milliseconds kLongestFade(500);

size_t BlocksPerSecond(const DeviceFormat& format) {
  return format.sample_rate_hz / format.block_frame_count + 1;
}

MixerSettings MixerSettingsOf(const OutputSettings& settings, const Clock& clock,
                              std::function<void()> wake) {
  const DeviceFormat& format = settings.format;
  return {.sample_rate_hz = static_cast<double>(format.sample_rate_hz),
          .block_frame_count = format.block_frame_count,
          .channel_count = format.channel_count,
          .clock = &clock,
          .full_scale_pa = settings.full_scale_pa,
          .wake = std::move(wake)};
}

}  // namespace

absl::StatusOr<std::unique_ptr<LiveOutput>> LiveOutput::Start(const OutputSettings& settings,
                                                              Clock& clock, Log log) {
  std::unique_ptr<LiveOutput> output(new LiveOutput(settings, clock, std::move(log)));
  RETURN_IF_ERROR(output->Open());
  return output;
}

LiveOutput::LiveOutput(const OutputSettings& settings, Clock& clock, Log log)
    : settings_(settings),
      clock_(clock),
      log_(std::move(log)),
      mixer_(MixerSettingsOf(settings, clock, [this] { Wake(); })),
      broadcast_(settings.format, BlocksPerSecond(settings.format)),
      stems_(mixer_, settings.format, BlocksPerSecond(settings.format)),
      look_ahead_(
          settings.format, settings.look_ahead_block_count,
          [this](std::span<float> block) { RenderBlock(block); }, clock),
      final_fade_(settings.format),
      needed_at_(clock.Monotonic()),
      silence_(kBlocksTogether * settings.format.block_size()),
      loudness_(settings.format.sample_rate_hz, settings.format.channel_count),
      loss_log_(settings.format.sample_rate_hz, log_) {}

LiveOutput::~LiveOutput() {
  stopping_ = true;
  woken_.release();
  if (housekeeper_.joinable()) housekeeper_.join();
  {
    const MutexLock lock(&pause_mutex_);
    paused_ = false;  // so that the keeper, which may find a device now, does not end the pause
  }
  keeper_.reset();
  look_ahead_.Stop();
}

absl::Status LiveOutput::Open() {
  if (absl::Status status = look_ahead_.Start(); !status.ok()) log_(std::string(status.message()));
  ASSIGN_OR_RETURN(keeper_,
                   DeviceKeeper::Start({.specification = settings_.device,
                                        .format = settings_.format,
                                        .program = settings_.device_program},
                                       look_ahead_.source(), clock_, log_, [this] { Wake(); }));
  housekeeper_ = std::thread([this] { KeepHouse(); });
  // Listeners play what it delivers. LookAhead makes the same request and reports the refusal.
  MakeRealtime(housekeeper_, Urgency::kDelivery).IgnoreError();
  return absl::OkStatus();
}

void LiveOutput::RenderBlock(std::span<float> block) {
  const FlushDenormals flush;
  const uint64_t first_frame = mixer_.frame();
  mixer_.Render(block);
  final_fade_.Apply(block);
  broadcast_.Publish(first_frame, block);
  // Listeners get the block at once. This wakes the housekeeping thread and waits for nothing.
  if (heard_.load(std::memory_order_relaxed)) woken_.release();
}

absl::StatusOr<std::unique_ptr<BlockBroadcast::Listener>> LiveOutput::Listen(
    std::optional<BusId> bus, std::function<void()> wake) {
  auto listener =
      bus ? stems_.Subscribe(*bus, std::move(wake)) : broadcast_.Subscribe(std::move(wake));
  Wake();
  return listener;
}

bool LiveOutput::paused() const {
  const MutexLock lock(&pause_mutex_);
  return paused_;
}

void LiveOutput::Wake() {
  {
    const MutexLock lock(&pause_mutex_);
    needed_at_ = clock_.Monotonic();
    if (!paused_) return;
    Resume();
  }
  woken_.release();
}

bool LiveOutput::KeepPace() {
  const MutexLock lock(&pause_mutex_);
  const std::chrono::nanoseconds now = clock_.Monotonic();
  if (paused_) RenderDueSilence();
  if (!MayPause()) {
    needed_at_ = now;
    if (paused_) Resume();
  } else if (!paused_ && now - needed_at_ >= settings_.pause_after) {
    Pause();
  }
  return paused_;
}

bool LiveOutput::IsHeard() const {
  return broadcast_.listener_count() > 0 || stems_.has_listeners();
}

bool LiveOutput::MayPause() const { return mixer_.resting() && !IsHeard(); }

void LiveOutput::Pause() {
  // Blocks that are rendered while the threads stop count as rendered in the pause.
  paused_at_ = clock_.Monotonic();
  paused_frame_ = mixer_.frame();
  if (!keeper_->Pause()) return;
  look_ahead_.Stop();
  paused_ = true;
  Deliver();  // a later listener gets no block from before the pause
}

void LiveOutput::Resume() {
  RenderDueSilence();
  paused_ = false;
  // The ring buffer still holds the silence that was rendered before the pause.
  look_ahead_.Start().IgnoreError();  // Open has logged a refusal
  keeper_->Resume();
}

/// Renders the blocks that the device would have asked for meanwhile. They are silent until an
/// event comes, which a stream that opens announces before. A listener that comes just now hears
/// them.
void LiveOutput::RenderDueSilence() {
  const DeviceFormat& format = settings_.format;
  const std::chrono::duration<double> elapsed = clock_.Monotonic() - paused_at_;
  const auto due_count =
      static_cast<uint64_t>(elapsed.count() * format.sample_rate_hz) / format.block_frame_count;
  const uint64_t done_count = (mixer_.frame() - paused_frame_) / format.block_frame_count;
  const bool heard = broadcast_.listener_count() > 0;
  for (uint64_t left = due_count - std::min(done_count, due_count); left > 0;) {
    const size_t together = heard ? 1 : std::min<uint64_t>(left, kBlocksTogether);
    const std::span<float> blocks = std::span(silence_).first(together * format.block_size());
    const uint64_t first_frame = mixer_.frame();
    mixer_.Render(blocks);
    if (heard) broadcast_.Publish(first_frame, blocks);
    left -= together;
  }
}

OutputState LiveOutput::state() const {
  OutputState state;
  state.load = look_ahead_.load();
  state.mixer = mixer_.statistics();
  const DeviceState device = keeper_->state();
  state.device = device.description;
  state.device_plays = device.plays;
  state.device_message = device.message;
  state.latency_s = look_ahead_.latency_s() + device.latency_s;
  state.xrun_count = look_ahead_.xrun_count() + device.xrun_count;
  state.lost_frame_count = look_ahead_.lost_frame_count() + device.lost_frame_count;
  const MutexLock lock(&mutex_);
  for (const Peak& peak : peaks_) state.peak = std::max(state.peak, peak.value);
  state.momentary_lufs = momentary_lufs_;
  state.short_term_lufs = short_term_lufs_;
  return state;
}

OutputVolume LiveOutput::volume() const {
  const MutexLock lock(&mutex_);
  return volume_;
}

OutputVolume LiveOutput::ChangeVolume(std::optional<double> gain, std::optional<bool> muted) {
  const MutexLock lock(&mutex_);
  volume_ = {.gain = gain.value_or(volume_.gain), .muted = muted.value_or(volume_.muted)};
  mixer_.SetGain(volume_.muted ? 0 : volume_.gain);
  return volume_;
}

void LiveOutput::FadeOut() {
  final_fade_.Begin();
  if (paused()) return;
  const std::chrono::nanoseconds longest = clock_.Monotonic() + kLongestFade;
  while (!final_fade_.ended() && clock_.Monotonic() < longest) {
    clock_.SleepUntil(clock_.Monotonic() + kHousekeepingPeriod);
  }
  const auto latency = std::chrono::duration<double>(state().latency_s);
  const auto drained =
      clock_.Monotonic() + std::chrono::duration_cast<std::chrono::nanoseconds>(latency);
  clock_.SleepUntil(std::min(drained, longest));
}

void LiveOutput::KeepHouse() {
  std::chrono::nanoseconds levels_due = clock_.Monotonic();
  std::chrono::nanoseconds losses_due = levels_due + kLossPeriod;
  while (!stopping_) {
    Deliver();
    mixer_.CollectGarbage();
    const std::chrono::nanoseconds now = clock_.Monotonic();
    if (now >= levels_due) {
      NoteLevels();
      levels_due = std::max(levels_due + kLevelPeriod, now);
    }
    if (now >= losses_due) {
      NoteLosses();
      losses_due = now + kLossPeriod;
    }
    heard_ = IsHeard();
    woken_.try_acquire_for(KeepPace() ? kPausePeriod : kHousekeepingPeriod);
  }
}

void LiveOutput::Deliver() {
  broadcast_.Deliver([this](const RenderedBlock& block) { loudness_.Add(block.samples); });
  stems_.Deliver();
}

void LiveOutput::NoteLevels() {
  const std::chrono::nanoseconds now = clock_.Monotonic();
  const MutexLock lock(&mutex_);
  peaks_.push_back({.time = now, .value = mixer_.TakePeak()});
  while (peaks_.front().time < now - kPeakMemory) peaks_.pop_front();
  momentary_lufs_ = loudness_.momentary();
  short_term_lufs_ = loudness_.short_term();
}

void LiveOutput::NoteLosses() {
  const DeviceState device = keeper_->state();
  loss_log_.Note(look_ahead_.lost_frame_count() + device.lost_frame_count, clock_.Monotonic(),
                 !device.message.empty());
}

}  // namespace carillon
