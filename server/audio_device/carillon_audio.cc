// SPDX-License-Identifier: Apache-2.0
//
// carillon-audio NAME SAMPLE_RATE BLOCK_FRAMES CHANNELS: the sound card's process of carillond,
// which starts it. It opens the device through PortAudio, plays the frames that the daemon renders
// into shared memory, and tells the daemon about the device; see device_report.h.

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/audio_device/descriptor_message.h"
#include "server/audio_device/device_report.h"
#include "server/audio_device/frame_ring.h"
#include "server/audio_device/portaudio_device.h"

namespace carillon {
namespace {

using State = DeviceReport::State;

constexpr int kPeriod_ms = 20;
constexpr unsigned kEndLimit_s = 1;

/// Lets the kernel end this process a second after the daemon, also if a call of PortAudio waits
/// for ever. Before its own end the daemon kills a process that it has no use for.
void EndWithDaemon() {
  signal(SIGALRM, SIG_DFL);
  signal(SIGUSR1, [](int /*number*/) { alarm(kEndLimit_s); });
  prctl(PR_SET_PDEATHSIG, SIGUSR1);
  pollfd daemon{kDaemonSocket, POLLRDHUP, 0};
  if (poll(&daemon, 1, 0) > 0) alarm(kEndLimit_s);  // the daemon died before the line above
}

void Send(const DeviceReport& report) {
  // A report that finds the socket full is dropped: the next one says the same.
  send(kDaemonSocket, &report, sizeof report, MSG_DONTWAIT | MSG_NOSIGNAL);
}

void Send(State state, const AudioDevice& device) {
  DeviceReport report{.state = state,
                      .latency_s = device.latency_s(),
                      .xrun_count = device.xrun_count(),
                      .lost_frame_count = device.lost_frame_count()};
  report.set_text(device.description());
  Send(report);
}

void Send(const absl::Status& failure) {
  DeviceReport report{.state = State::kFailed, .code = failure.code()};
  report.set_text(failure.message());
  Send(report);
}

/// Waits for one period. False: the daemon has closed its end.
bool DaemonListens() {
  pollfd daemon{kDaemonSocket, POLLRDHUP, 0};
  return poll(&daemon, 1, kPeriod_ms) <= 0;
}

absl::Status Play(AudioDevice& device, FrameRing& ring) {
  RETURN_IF_ERROR(device.Start(ring));
  do {
    RETURN_IF_ERROR(device.Check());
    Send(State::kPlaying, device);
  } while (DaemonListens());
  return absl::OkStatus();
}

absl::Status Serve(absl::string_view name, const DeviceFormat& format) {
  ASSIGN_OR_RETURN(const std::unique_ptr<AudioDevice> device, OpenPortAudioDevice(name, format));
  Send(State::kOpen, *device);
  // The daemon asks for sound, or has no use for it any more.
  const std::optional<int> memory = ReceiveDescriptor(kDaemonSocket);
  if (!memory) return absl::OkStatus();
  ASSIGN_OR_RETURN(const std::unique_ptr<FrameRing> ring, FrameRing::Map(*memory));
  const absl::Status status = Play(*device, *ring);
  // Sent here, because PortAudio may wait for ever when the device is closed.
  if (!status.ok()) Send(status);
  device->Stop();
  return absl::OkStatus();
}

std::optional<DeviceFormat> ParseFormat(const char* const* words) {
  DeviceFormat format;
  if (!absl::SimpleAtoi(words[0], &format.sample_rate_hz) ||
      !absl::SimpleAtoi(words[1], &format.block_frame_count) ||
      !absl::SimpleAtoi(words[2], &format.channel_count)) {
    return std::nullopt;
  }
  return format;
}

int Main(int argc, const char* const* argv) {
  const std::optional<DeviceFormat> format = argc == 5 ? ParseFormat(argv + 2) : std::nullopt;
  if (!format) {
    std::cerr << "carillon-audio is started by carillond\n";
    return 2;
  }
  // The daemon says when the sound ends; a signal to both processes must not end it before.
  signal(SIGINT, SIG_IGN);
  signal(SIGTERM, SIG_IGN);
  signal(SIGHUP, SIG_IGN);
  EndWithDaemon();
  const absl::Status status = Serve(argv[1], *format);
  if (!status.ok()) Send(status);
  return status.ok() ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) { return carillon::Main(argc, argv); }
