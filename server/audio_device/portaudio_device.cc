// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/portaudio_device.h"

#include <portaudio.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/audio_device/output_clock.h"

namespace carillon {
namespace {

/// With less latency, PulseAudio behind ALSA drops out.
constexpr double kMinAlsaLatency_s = 0.020;
constexpr int kMaxChannelCount = 2;
/// Checks without a pull after which a device counts as gone: at one every 20 ms, a second.
constexpr int kMaxIdleCheckCount = 50;

absl::Status Failed(absl::string_view what, PaError error) {
  return Refusal(absl::StatusCode::kUnavailable, "AUDIO_DEVICE_FAILED",
                 absl::StrCat(what, ": ", Pa_GetErrorText(error)));
}

/// "JACK Audio Connection Kit: system".
std::string FullName(PaDeviceIndex index) {
  const PaDeviceInfo* device = Pa_GetDeviceInfo(index);
  return absl::StrCat(Pa_GetHostApiInfo(device->hostApi)->name, ": ", device->name);
}

std::vector<PaDeviceIndex> OutputDevices() {
  std::vector<PaDeviceIndex> outputs;
  for (PaDeviceIndex index = 0; index < Pa_GetDeviceCount(); ++index) {
    if (Pa_GetDeviceInfo(index)->maxOutputChannels > 0) outputs.push_back(index);
  }
  return outputs;
}

absl::StatusOr<PaDeviceIndex> FindDevice(absl::string_view name) {
  const std::vector<PaDeviceIndex> outputs = OutputDevices();
  if (outputs.empty()) {
    return Refusal(
        absl::StatusCode::kNotFound, "AUDIO_DEVICE_NOT_FOUND",
        "there is no sound device on this machine; Listen and the file device still work");
  }
  if (name.empty()) {
    const PaDeviceIndex preferred = Pa_GetDefaultOutputDevice();
    return preferred != paNoDevice ? preferred : outputs.front();
  }
  std::string known;
  for (const PaDeviceIndex index : outputs) {
    const std::string full_name = FullName(index);
    if (absl::StrContains(absl::AsciiStrToLower(full_name), absl::AsciiStrToLower(name))) {
      return index;
    }
    absl::StrAppend(&known, known.empty() ? "" : ", ", "\"", full_name, "\"");
  }
  return Refusal(absl::StatusCode::kNotFound, "AUDIO_DEVICE_NOT_FOUND",
                 absl::StrCat("no sound device's name contains \"", name, "\"; there is ", known));
}

/// Keeps PortAudio initialized while it lives; PortAudio counts nested use.
class Library {
 public:
  Library() : error_(Pa_Initialize()) {}
  ~Library() {
    if (error_ == paNoError) Pa_Terminate();
  }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  PaError error() const { return error_; }

 private:
  PaError error_;
};

class PortAudioDevice final : public AudioDevice {
 public:
  explicit PortAudioDevice(const DeviceFormat& format) : format_(format) {}
  ~PortAudioDevice() override { Stop(); }

  absl::Status Open(absl::string_view name) {
    library_ = std::make_unique<Library>();
    if (library_->error() != paNoError) return Failed("PortAudio", library_->error());
    ASSIGN_OR_RETURN(PaDeviceIndex device, FindDevice(name));
    name_ = FullName(device);
    return OpenStream(device);
  }

  absl::Status Start(FrameSource& source) override {
    source_ = &source;
    clock_->Restart();
    if (const PaError error = Pa_StartStream(stream_); error != paNoError) {
      return Failed(name_, error);
    }
    return absl::OkStatus();
  }

  void Stop() override {
    if (stream_ == nullptr) return;
    Pa_AbortStream(stream_);
    Pa_CloseStream(stream_);
    stream_ = nullptr;
  }

  std::string description() const override { return absl::StrCat("portaudio: ", name_); }
  /// PortAudio's figure for JACK does not include the cycle that is played while the next is
  /// pulled.
  double latency_s() const override {
    if (!is_jack_) return latency_s_;
    const size_t frames =
        std::max<size_t>(clock_->longest_cycle_frames(), format_.block_frame_count);
    return latency_s_ + static_cast<double>(frames) / format_.sample_rate_hz;
  }
  absl::Status Check() override {
    // A stream of JACK ends without a call of Finished when its server ends.
    if (finished_.load(std::memory_order_relaxed) || Pa_IsStreamActive(stream_) != 1) {
      return Gone("it has stopped; its sound server has ended, or the device is gone");
    }
    const uint64_t pull_count = pull_count_.load(std::memory_order_relaxed);
    idle_check_count_ = pull_count == checked_pull_count_ ? idle_check_count_ + 1 : 0;
    checked_pull_count_ = pull_count;
    if (idle_check_count_ < kMaxIdleCheckCount) return absl::OkStatus();
    return Gone("it asks for no sound any more; its sound server hangs, or the device is gone");
  }
  uint64_t xrun_count() const override { return clock_->xrun_count(); }
  uint64_t lost_frame_count() const override { return clock_->lost_frame_count(); }

 private:
  absl::Status Gone(absl::string_view why) const {
    return Refusal(absl::StatusCode::kUnavailable, "AUDIO_DEVICE_FAILED",
                   absl::StrCat(description(), ": ", why));
  }

  absl::Status OpenStream(PaDeviceIndex index) {
    const PaDeviceInfo* device = Pa_GetDeviceInfo(index);
    const PaHostApiTypeId api = Pa_GetHostApiInfo(device->hostApi)->type;
    const bool alsa = api == paALSA;
    channel_count_ = std::min(kMaxChannelCount, device->maxOutputChannels);
    if (channel_count() < format_.channel_count) {
      return Refusal(absl::StatusCode::kUnavailable, "AUDIO_DEVICE_FAILED",
                     absl::StrCat(name_, " has one channel; start the daemon with --channels 1"));
    }
    const PaStreamParameters parameters{
        .device = index,
        .channelCount = channel_count_,
        .sampleFormat = paFloat32,
        .suggestedLatency =
            std::max(device->defaultLowOutputLatency, alsa ? kMinAlsaLatency_s : 0.0),
        .hostApiSpecificStreamInfo = nullptr};
    const PaError error =
        Pa_OpenStream(&stream_, nullptr, &parameters, format_.sample_rate_hz,
                      format_.block_frame_count, paClipOff | paDitherOff, &Callback, this);
    if (error != paNoError) {
      stream_ = nullptr;
      return Failed(absl::StrCat(name_, " at ", format_.sample_rate_hz, " Hz"), error);
    }
    Pa_SetStreamFinishedCallback(stream_, &Finished);
    is_jack_ = api == paJACK;
    clock_.emplace(format_.sample_rate_hz,
                   is_jack_ ? LossKind::kWholeCycles : LossKind::kAnyLength);
    latency_s_ = Pa_GetStreamInfo(stream_)->outputLatency;
    return absl::OkStatus();
  }

  static int Callback(const void*, void* output, unsigned long frame_count,
                      const PaStreamCallbackTimeInfo* time, PaStreamCallbackFlags flags,
                      void* self) {
    auto* device = static_cast<PortAudioDevice*>(self);
    device->clock_->Count(time->currentTime, time->outputBufferDacTime, frame_count,
                          (flags & paOutputUnderflow) != 0);
    device->pull_count_.fetch_add(1, std::memory_order_relaxed);
    device->Fill({static_cast<float*>(output), frame_count * device->channel_count()});
    return paContinue;
  }

  static void Finished(void* self) {
    static_cast<PortAudioDevice*>(self)->finished_.store(true, std::memory_order_relaxed);
  }

  size_t channel_count() const { return static_cast<size_t>(channel_count_); }

  /// A mono mix is played on every channel: it is pulled into the front of `samples` and spread
  /// from the back.
  void Fill(std::span<float> samples) noexcept {
    if (format_.channel_count == channel_count()) return source_->Pull(samples);
    const size_t frame_count = samples.size() / channel_count();
    source_->Pull(samples.first(frame_count));
    for (size_t frame = frame_count; frame-- > 0;) {
      const float sample = samples[frame];
      for (size_t channel = 0; channel < channel_count(); ++channel) {
        samples[frame * channel_count() + channel] = sample;
      }
    }
  }

  const DeviceFormat format_;
  std::unique_ptr<Library> library_;
  PaStream* stream_ = nullptr;
  FrameSource* source_ = nullptr;
  std::string name_;
  int channel_count_ = 1;
  bool is_jack_ = false;
  double latency_s_ = 0;              ///< as PortAudio reports it
  std::optional<OutputClock> clock_;  ///< set once the stream is open
  std::atomic<bool> finished_{false};
  std::atomic<uint64_t> pull_count_{0};
  uint64_t checked_pull_count_ = 0;  ///< at the last Check
  int idle_check_count_ = 0;         ///< since the last pull
};

}  // namespace

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenPortAudioDevice(absl::string_view name,
                                                                 const DeviceFormat& format) {
  auto device = std::make_unique<PortAudioDevice>(format);
  RETURN_IF_ERROR(device->Open(name));
  return device;
}

}  // namespace carillon
