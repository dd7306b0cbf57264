// SPDX-License-Identifier: Apache-2.0
#include "server/scene/offline_renderer.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/scene/scene_volumes.h"
#include "server/synthesis/flush_denormals.h"

namespace carillon {
namespace {

constexpr uint32_t kLowestRateHz = 8000;
constexpr uint32_t kHighestRateHz = 192000;
constexpr double kLongestTailS = 120;
constexpr double kLongestOpenTailS = 60;
/// -80 dB of full scale.
constexpr float kQuiet = 1e-4F;
/// The sound must stay quiet for this time, because two modes that beat are silent together for a
/// while.
constexpr double kQuietS = 0.25;
constexpr size_t kOfflineQueueCapacity = 65536;
/// Memory that an object takes beside its model, and for each of its modes that sound.
constexpr size_t kObjectBytes = size_t{40} << 10U;
constexpr size_t kModeBytes = 64;

MixerSettings SettingsOf(const OfflineSettings& settings, SectionThreads& threads) {
  // Offline blocks have no deadline, so a block takes all its events.
  return {.sample_rate_hz = static_cast<double>(settings.sample_rate_hz),
          .block_frame_count = OfflineRenderer::kBlockFrameCount,
          .channel_count = settings.channel_count,
          .first_frame = settings.mapping.first_frame,
          .most_buses = 1,
          .stagger = settings.stagger,
          .most_streams = 1,
          .most_events_per_block = kOfflineQueueCapacity,
          .gain = settings.gain,
          .full_scale_pa = settings.full_scale_pa,
          .threads = &threads};
}

IntakeSettings IntakeSettingsOf(const OfflineSettings& settings, std::vector<BlowRecord>& blows) {
  return {.sample_rate_hz = static_cast<double>(settings.sample_rate_hz),
          .step_s = settings.step_s,
          .mapping = settings.mapping,
          .most_ahead_s = OfflineRenderer::kMaxDurationS,
          .reading = settings.reading,
          .blows = settings.tells_blows ? &blows : nullptr};
}

/// Returns the longest time, in frames, by which a contact begins before its impulse.
uint64_t LongestContactFrames(const std::deque<MixerEvent>& events, double sample_rate_hz) {
  float longest_s = 0;
  for (const MixerEvent& event : events) {
    if (event.impulse() == nullptr) continue;
    longest_s = std::max(longest_s, event.impulse()->pulse.duration_s());
  }
  return static_cast<uint64_t>(std::ceil(longest_s * sample_rate_hz)) + 1;
}

bool IsMove(const MixerEvent& event) {
  return std::holds_alternative<ObjectMove>(event.action) ||
         std::holds_alternative<ListenerMove>(event.action);
}

}  // namespace

absl::StatusOr<std::unique_ptr<OfflineRenderer>> OfflineRenderer::Make(
    const OfflineSettings& settings, BodyCache& bodies, TransferStore* transfers) {
  if (settings.sample_rate_hz < kLowestRateHz || settings.sample_rate_hz > kHighestRateHz) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("sample_rate_hz is ", settings.sample_rate_hz, "; it must be ",
                                kLowestRateHz, " to ", kHighestRateHz));
  }
  if (!(settings.tail_s >= 0 && settings.tail_s <= kLongestTailS)) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("tail_s is ", settings.tail_s, "; it must be 0 to ", kLongestTailS));
  }
  if (settings.channel_count < 1 || settings.channel_count > 2) {
    return Refusal(
        absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
        absl::StrCat("channel_count is ", settings.channel_count, "; it must be 1 or 2"));
  }
  RETURN_IF_ERROR(ValidateGain(settings.gain));
  if (!(settings.full_scale_pa >= kLeastFullScalePa &&
        settings.full_scale_pa <= kMostFullScalePa)) {
    return Refusal(absl::StatusCode::kInvalidArgument, "INVALID_SETTINGS",
                   absl::StrCat("full_scale_pa is ", settings.full_scale_pa, "; it must be ",
                                kLeastFullScalePa, " to ", kMostFullScalePa));
  }
  RETURN_IF_ERROR(Validate(settings.space));
  std::unique_ptr<OfflineRenderer> renderer(new OfflineRenderer(settings, bodies, transfers));
  ASSIGN_OR_RETURN(renderer->stream_, renderer->mixer_.OpenStream(kOfflineQueueCapacity));
  return renderer;
}

OfflineRenderer::OfflineRenderer(const OfflineSettings& settings, BodyCache& bodies,
                                 TransferStore* transfers)
    : settings_(settings),
      bodies_(bodies),
      transfers_(transfers),
      threads_(settings.thread_count),
      mixer_(SettingsOf(settings, threads_)),
      scene_("the trace", settings.space),
      target_(settings.mapping.first_frame),
      intake_(scene_, target_, IntakeSettingsOf(settings, blows_)) {}

absl::Status OfflineRenderer::AddObject(uint32_t handle, std::shared_ptr<const ModalModel> model,
                                        const ObjectProperties& properties) {
  RETURN_IF_ERROR(scene_.CheckFree(handle));
  ASSIGN_OR_RETURN(std::shared_ptr<const SoundingBody> body, bodies_.Get(std::move(model)));
  auto voice = MakeVoice(settings_.space, properties.pose, mixer_.settings());
  ASSIGN_OR_RETURN(SoundingObject object, MakeSoundingObject(std::move(body), properties, {mixer_},
                                                             std::move(voice), transfers_));
  if (object.transfer == nullptr && properties.radiation == RadiationModel::kDefault) {
    ++summary_.paper_coupling_object_count;
  }
  object_bytes_ += kObjectBytes + object.mode_count * kModeBytes;
  return scene_.Insert(handle, std::move(object));
}

size_t OfflineRenderer::held_bytes() const {
  return object_bytes_ + events().size() * sizeof(MixerEvent) +
         blows_.capacity() * sizeof(BlowRecord);
}

size_t OfflineRenderer::Render(std::span<float> samples) {
  if (!begun_) {
    intake_.Finish();
    // The sort is stable, because live events of one sample keep their order, too.
    // A copy of the events is made only for a sort that is needed.
    if (!std::ranges::is_sorted(events(), {}, &MixerEvent::FirstSample)) {
      std::ranges::stable_sort(events(), {}, &MixerEvent::FirstSample);
    }
    const auto last = std::find_if_not(events().rbegin(), events().rend(), IsMove);
    contact_count_ = static_cast<size_t>(events().rend() - last);
    ahead_frame_count_ = LongestContactFrames(events(), mixer_.settings().sample_rate_hz);
  }
  begun_ = true;
  const FlushDenormals flush;
  size_t count = 0;
  while (!ended_ && (count + kBlockFrameCount) * settings_.channel_count <= samples.size()) {
    count += RenderBlocks(samples.subspan(count * settings_.channel_count));
  }
  return count;
}

/// Renders blocks into the front of `samples`. Returns the number of frames that belong to the
/// sound.
size_t OfflineRenderer::RenderBlocks(std::span<float> samples) {
  const size_t block_size = kBlockFrameCount * settings_.channel_count;
  const size_t block_count = CountBlocks(samples.size() / block_size);
  samples = samples.first(block_count * block_size);
  const uint64_t first = mixer_.frame();
  size_t count = block_count * kBlockFrameCount;
  PushEventsBefore(first + count);
  mixer_.Render(samples);
  mixer_.CollectGarbage();
  if (pushed_count_ >= contact_count_) {
    count =
        static_cast<size_t>(std::min<uint64_t>(count, EndFrame() - std::min(first, EndFrame())));
    for (size_t n = 0; n < count && !ended_; n += kBlockFrameCount) {
      ended_ = TailEnded(samples.subspan(n * settings_.channel_count, block_size));
      if (ended_) count = std::min(count, n + kBlockFrameCount);
    }
    ended_ = ended_ || mixer_.frame() >= EndFrame();
  }
  const MixerStatistics statistics = mixer_.statistics();
  summary_.frame_count += count;
  summary_.accepted_count = statistics.accepted_count + statistics.late_count;
  summary_.rejected_count = intake_.rejected_count();
  summary_.last_rejection = intake_.last_rejection();
  summary_.findings = intake_.findings();
  summary_.limited_frame_count = statistics.limited_frame_count;
  summary_.peak = std::max(summary_.peak, mixer_.TakePeak());
  return count;
}

/// Returns the number of blocks to render together. No block lies past the end, and the queue holds
/// the events of all these blocks.
size_t OfflineRenderer::CountBlocks(size_t most) const {
  const uint64_t first = mixer_.frame();
  const uint64_t left = EndFrame() - std::min(first, EndFrame());
  size_t count = std::min<size_t>({most, kBlocksTogether, left / kBlockFrameCount + 1});
  const size_t full = pushed_count_ + kOfflineQueueCapacity / 2;
  while (count > 1 && full < events().size() &&
         events()[full].FirstSample() < first + count * kBlockFrameCount + ahead_frame_count_) {
    --count;
  }
  return count;
}

uint64_t OfflineRenderer::EndFrame() const {
  const uint64_t last = contact_count_ == 0 ? settings_.mapping.first_frame
                                            : events()[contact_count_ - 1].FirstSample();
  const double tail_s = settings_.tail_s > 0 ? settings_.tail_s : kLongestOpenTailS;
  return last + static_cast<uint64_t>(std::ceil(tail_s * settings_.sample_rate_hz));
}

/// Pushes the events before `frame`. Then pushes the events whose contacts may begin before
/// `frame`, until the mixer's queue is full.
void OfflineRenderer::PushEventsBefore(uint64_t frame) {
  while (pushed_count_ < events().size()) {
    const MixerEvent& event = events()[pushed_count_];
    if (event.FirstSample() >= frame + ahead_frame_count_) return;
    if (!stream_->TryPush(event)) {
      if (event.FirstSample() >= frame) return;
      intake_.Reject(
          1, Refusal(absl::StatusCode::kResourceExhausted, "TRACE_TOO_LARGE",
                     absl::StrCat("over ", kOfflineQueueCapacity, " events fall into the block at ",
                                  static_cast<double>(frame) / settings_.sample_rate_hz,
                                  " s of the sound; render fewer objects")));
    }
    ++pushed_count_;
  }
}

bool OfflineRenderer::TailEnded(std::span<const float> block) {
  const bool quiet = std::ranges::all_of(block, [](float x) { return std::abs(x) < kQuiet; });
  quiet_frame_count_ = quiet ? quiet_frame_count_ + kBlockFrameCount : 0;
  return settings_.tail_s == 0 &&
         static_cast<double>(quiet_frame_count_) >= QuietS() * settings_.sample_rate_hz;
}

/// Returns the time for which the sound must be quiet, because sound may still be on its way to the
/// listener.
double OfflineRenderer::QuietS() const {
  return kQuietS + (settings_.space.hearing.propagation_delay ? kLongestPropagationS : 0);
}

}  // namespace carillon
