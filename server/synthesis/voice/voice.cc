// SPDX-License-Identifier: Apache-2.0
#include "server/synthesis/voice/voice.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/synthesis/voice/vector3.h"

namespace carillon {
namespace {

constexpr double kFadeS = 0.01;
/// A delay that grows or shrinks faster than this, in frames per frame, is treated as a jump. An
/// object that comes nearer at v shrinks its delay by v/(c - v), so 3 is three quarters of the
/// speed of sound, two octaves up. At a growth of 1, the listener would outrun the sound.
constexpr double kFastestGrowth = 0.9, kFastestShrinking = 3;
/// Within this distance an object's panning moves to the middle.
constexpr double kNearM = 0.1;

size_t HistoryBlocks(const Voice::Settings& settings) {
  if (!settings.hearing.propagation_delay) return 1;
  return static_cast<size_t>(kLongestPropagationS * settings.sample_rate_hz /
                             static_cast<double>(settings.block_frame_count)) +
         3;
}

}  // namespace

Voice::Voice(const Settings& settings, const Place& object, const Place& listener)
    : settings_(settings),
      object_(object, settings.sample_rate_hz, settings.block_frame_count),
      listener_(listener, settings.sample_rate_hz, settings.block_frame_count),
      positions_(HistoryBlocks(settings), object.position_m),
      input_(settings.block_frame_count),
      fade_step_(static_cast<float>(1 / (kFadeS * settings.sample_rate_hz))) {
  if (settings.hearing.binaural && settings.head && settings.channel_count == 2) {
    ears_.assign(2, Ears(*settings.head, settings.block_frame_count));
    sound_.resize(settings.block_frame_count);
  }
  double longest_delay = delayed() ? kLongestPropagationS * settings.sample_rate_hz : 0;
  if (binaural()) {
    const auto tap_count = static_cast<double>(settings.head->tap_count());
    longest_delay += DelayLine::kLeastDelay + settings.head->longest_delay() + tap_count;
  }
  if (longest_delay > 0) {
    line_.emplace(static_cast<size_t>(longest_delay) + 1, 2 * settings.block_frame_count);
  }
  heard_.fill(Hear(0));
  if (binaural()) NoteEars(true);
}

void Voice::SetCenter(const Vector3& center_m) noexcept {
  if (center_m == center_m_) return;
  center_m_ = center_m;
  positions_.Fill(SoundAt(object_.place()));
  jump_waits_ = true;
}

Bearing Voice::BearingOfListener() const noexcept {
  const Place object = object_.begin();
  const Vector3 away = Minus(listener_.begin().position_m, SoundAt(object));
  Bearing bearing{.distance_m = Length(away)};
  if (bearing.distance_m == 0) return bearing;
  bearing.direction = Rotated(away, Inverse(object.orientation));
  for (double& coordinate : bearing.direction) coordinate /= bearing.distance_m;
  return bearing;
}

Vector3 Voice::SoundAt(const Place& object) const noexcept {
  if (center_m_ == Vector3{}) return object.position_m;
  const Vector3 center = Rotated(center_m_, object.orientation);
  return {object.position_m[0] + center[0], object.position_m[1] + center[1],
          object.position_m[2] + center[2]};
}

/// Delay and gains at the end of the last block; `delay_frames` is a first estimate of the delay.
Voice::Heard Voice::Hear(double delay_frames) const noexcept {
  const HearingSettings& hearing = settings_.hearing;
  const Place listener = listener_.place();
  SoundPath path{.away_m = Minus(positions_.newest(), listener.position_m)};
  if (delayed()) {
    const DelayLimits limits{
        .frames_per_metre = settings_.sample_rate_hz / hearing.sound_speed_m_per_s,
        .block_frame_count = settings_.block_frame_count,
        .least_frames = DelayLine::kLeastDelay,
        .most_frames = kLongestPropagationS * settings_.sample_rate_hz};
    path = FindSoundPath(positions_, listener.position_m, limits, delay_frames);
  }
  Heard heard{.delay_frames = path.delay_frames};
  if (binaural()) HearBinaurally(path.away_m, listener, heard);
  const double distance = Length(path.away_m);
  const double reference = hearing.reference_distance_m;
  const double gain = hearing.distance_gain ? reference / std::max(distance, reference) : 1;
  heard.gains.fill(static_cast<float>(gain));
  if (hearing.ambisonic) {
    Vector3 direction = Rotated(path.away_m, Inverse(listener.orientation));
    for (double& coordinate : direction) coordinate = distance > 0 ? coordinate / distance : 0;
    heard.gains = AmbisonicGains(direction);
    for (float& channel : heard.gains) channel *= static_cast<float>(gain);
    return heard;
  }
  if (hearing.panning && settings_.channel_count == 2 && !binaural()) {
    const double unit = std::max(Length(listener.right), 0.5);
    const double side = std::clamp(
        Dot(listener.right, path.away_m) / (unit * std::max(distance, kNearM)), -1.0, 1.0);
    const double angle = std::numbers::pi * (1 + side) / 4;
    heard.gains = {static_cast<float>(gain * std::numbers::sqrt2 * std::cos(angle)),
                   static_cast<float>(gain * std::numbers::sqrt2 * std::sin(angle))};
  }
  return heard;
}

void Voice::HearBinaurally(const Vector3& away_m, const Place& listener,
                           Heard& heard) const noexcept {
  heard.delay_frames = std::max(heard.delay_frames, DelayLine::kLeastDelay);
  if (Length(away_m) > 0) heard.direction = Rotated(away_m, Inverse(listener.orientation));
  heard.ear_delay_frames = settings_.head->Delays(heard.direction);
}

void Voice::NoteHeard() noexcept {
  if (!delayed() && !binaural() && !jump_waits_ && rested()) return;
  object_.Advance();
  listener_.Advance();
  positions_.Add(SoundAt(object_.place()));
  if (object_.jumped()) positions_.Fill(SoundAt(object_.place()));
  const double trend = 2 * heard_[3].delay_frames - heard_[2].delay_frames;
  const Heard next = Hear(trend);
  const double growth = (next.delay_frames - heard_[3].delay_frames) /
                        static_cast<double>(settings_.block_frame_count);
  jump_waits_ |= object_.jumped() || listener_.jumped() || growth > kFastestGrowth ||
                 growth < -kFastestShrinking;
  if (!jump_waits_) {
    heard_ = {heard_[1], heard_[2], heard_[3], next};
  } else if (fade_ < 1) {  // the new jump waits until the present cross-fade has ended
    heard_ = {heard_[1], heard_[2], heard_[3], heard_[3]};
  } else {
    heard_before_.fill(heard_[2]);
    heard_.fill(next);
    fade_ = silent() ? 1 : 0;
    jump_waits_ = false;
    if (binaural()) NoteEars(true);
    return;
  }
  if (binaural()) NoteEars(false);
}

void Voice::NoteEars(bool jumps) noexcept {
  const Vector3& direction = heard_[2].direction;
  if (jumps) {
    ears_now_ = 1 - ears_now_;
    ears_[ears_now_].Jump(*settings_.head, direction);
  } else {
    ears_[ears_now_].Turn(*settings_.head, direction);
  }
  ears_[1 - ears_now_].Hold();
}

void Voice::RenderSound(std::span<float> frames) noexcept {
  if (line_) line_->Write(input_);
  if (fade_ < 1) {
    RenderFrom(heard_before_, 1 - fade_, -fade_step_, frames);
    RenderFrom(heard_, fade_, fade_step_, frames);
    fade_ += fade_step_ * static_cast<float>(input_.size());
  } else {
    RenderFrom(heard_, 1, 0, frames);
  }
}

void Voice::Render(std::span<float> frames) noexcept {
  NoteHeard();
  if (sounding()) {
    RenderSound(frames);
  } else {
    fade_ = 1;  // a jump in silence needs no cross-fade
  }
  quiet_frame_count_ = fed_ ? 0 : quiet_frame_count_ + input_.size();
  rest_block_count_ = object_.at_rest() && listener_.at_rest() ? rest_block_count_ + 1 : 0;
  asleep_ = silent() && rested();
  if (fed_) std::ranges::fill(input_, 0.0F);
  fed_ = false;
}

void Voice::Silence() noexcept {
  std::ranges::fill(input_, 0.0F);
  fed_ = false;
  if (line_) line_->Silence();
  for (Ears& ears : ears_) ears.Silence();
}

void Voice::RenderEars(const Hearings& heard, Ears& ears, float fade, float fade_step,
                       std::span<float> frames) noexcept {
  const auto size = static_cast<double>(input_.size());
  for (size_t ear = 0; ear < ears_.size(); ++ear) {
    std::array<double, 4> delays{};
    for (size_t i = 0; i < delays.size(); ++i) {
      delays[i] = heard[i].delay_frames + heard[i].ear_delay_frames[ear];
    }
    const DelayCurve delay(delays);
    const float from = heard[1].gains[ear], to = heard[2].gains[ear];
    const std::span<float> past = ears.past(ear);
    for (size_t n = 0; n < past.size(); ++n) {
      past[n] = from * line_->Read(delays[1] + size + static_cast<double>(past.size() - n));
    }
    const std::span<float> signal = ears.signal(ear);
    for (size_t n = 0; n < signal.size(); ++n) {
      const double u = static_cast<double>(n) / size;
      signal[n] = (from + static_cast<float>(u) * (to - from)) * Sample(delay.At(u), n);
    }
    ears.Filter(ear, sound_);
    for (size_t n = 0; n < sound_.size(); ++n) {
      const float faded = std::clamp(fade + static_cast<float>(n) * fade_step, 0.0F, 1.0F);
      frames[2 * n + ear] += faded * sound_[n];
    }
  }
}

float Voice::Sample(double delay_frames, size_t n) const noexcept {
  return line_ ? line_->Read(delay_frames + static_cast<double>(input_.size() - n)) : input_[n];
}

/// Renders without delay and cross-fade, in loops that compilers vectorise.
void Voice::RenderHere(const Hearings& heard, std::span<float> frames) const noexcept {
  const size_t channels = settings_.channel_count;
  const auto frame_count = static_cast<int>(input_.size());
  for (size_t channel = 0; channel < channels; ++channel) {
    const float from = heard[1].gains[channel], to = heard[2].gains[channel];
    const float step = (to - from) / static_cast<float>(frame_count);
    const float* const in = input_.data();
    float* const out = frames.data() + channel;
    const auto add = [=](size_t stride) {
      for (int n = 0; n < frame_count; ++n) {
        out[static_cast<size_t>(n) * stride] += in[n] * (from + static_cast<float>(n) * step);
      }
    };
    if (channels == 1) {
      add(1);
    } else {
      add(channels);
    }
  }
}

void Voice::RenderFrom(const Hearings& heard, float fade, float fade_step,
                       std::span<float> frames) noexcept {
  if (binaural()) {
    return RenderEars(heard, ears_[&heard == &heard_ ? ears_now_ : 1 - ears_now_], fade, fade_step,
                      frames);
  }
  const size_t channels = settings_.channel_count;
  if (!line_ && fade == 1 && fade_step == 0) return RenderHere(heard, frames);
  const DelayCurve delay(
      {heard[0].delay_frames, heard[1].delay_frames, heard[2].delay_frames, heard[3].delay_frames});
  const double step = 1 / static_cast<double>(input_.size());
  for (size_t n = 0; n < input_.size(); ++n) {
    const double u = static_cast<double>(n) * step;
    const float sample = std::clamp(fade, 0.0F, 1.0F) * Sample(delay.At(u), n);
    for (size_t channel = 0; channel < channels; ++channel) {
      const float from = heard[1].gains[channel], to = heard[2].gains[channel];
      frames[n * channels + channel] += sample * (from + static_cast<float>(u) * (to - from));
    }
    fade += fade_step;
  }
}

}  // namespace carillon
