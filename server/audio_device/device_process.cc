// SPDX-License-Identifier: Apache-2.0
#include "server/audio_device/device_process.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/program/child_process.h"
#include "proto/cpp/status_macros.h"
#include "server/audio_device/descriptor_message.h"
#include "server/audio_device/device_report.h"

namespace carillon {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Searching for devices and opening one takes 0.1 to 0.5 s.
constexpr milliseconds kOpenLimit(3000);
constexpr milliseconds kStartLimit(1000);
/// A device that plays reports every 20 ms.
constexpr milliseconds kSilenceLimit(2000);
constexpr milliseconds kEndLimit(500);

absl::Status Failed(absl::string_view message) {
  return Refusal(absl::StatusCode::kUnavailable, "AUDIO_DEVICE_FAILED", message);
}

/// The daemon's end of the socket.
class ReportSocket {
 public:
  explicit ReportSocket(int descriptor) : descriptor_(descriptor) {}
  ReportSocket(ReportSocket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  ReportSocket& operator=(ReportSocket&&) = delete;
  ~ReportSocket() { Close(); }

  void Close() {
    if (descriptor_ >= 0) close(descriptor_);
    descriptor_ = -1;
  }

  /// The next report, if one arrives within `limit`.
  std::optional<DeviceReport> Receive(milliseconds limit) const {
    pollfd readable{descriptor_, POLLIN, 0};
    DeviceReport report;
    if (poll(&readable, 1, static_cast<int>(limit.count())) <= 0 ||
        recv(descriptor_, &report, sizeof report, MSG_DONTWAIT) != sizeof report) {
      return std::nullopt;
    }
    report.text.back() = '\0';
    return report;
  }

  bool Send(int sent_descriptor) const { return SendDescriptor(descriptor_, sent_descriptor); }

 private:
  int descriptor_;
};

class DeviceProcess final : public AudioDevice {
 public:
  DeviceProcess(ReportSocket socket, ChildProcess process, Clock& clock)
      : clock_(clock), socket_(std::move(socket)), process_(std::move(process)) {}
  ~DeviceProcess() override { Stop(); }

  /// Waits until the device is open.
  absl::Status AwaitOpen() { return Await(DeviceReport::State::kOpen, kOpenLimit); }

  absl::Status Start(FrameSource& source) override {
    if (!socket_.Send(source.shared_memory())) return Fail("its process has ended");
    return Await(DeviceReport::State::kPlaying, kStartLimit);
  }

  void Stop() override {
    if (!process_) return;
    socket_.Close();  // which tells the process to end
    pollfd ended{process_->descriptor(), POLLIN, 0};
    if (state_.ok()) poll(&ended, 1, static_cast<int>(kEndLimit.count()));
    process_.reset();  // kills it if it has not ended
  }

  absl::Status Check() override {
    while (state_.ok()) {
      const std::optional<DeviceReport> report = socket_.Receive(milliseconds(0));
      if (!report) break;
      Take(*report);
    }
    if (state_.ok() && process_->Reap()) return Fail("its process has ended");
    if (state_.ok() && clock_.Monotonic() - last_report_ > kSilenceLimit) {
      return Fail("its process does not answer");
    }
    return state_;
  }

  std::string description() const override { return description_; }
  double latency_s() const override { return latency_s_.load(std::memory_order_relaxed); }
  uint64_t xrun_count() const override { return xrun_count_.load(std::memory_order_relaxed); }
  uint64_t lost_frame_count() const override {
    return lost_frame_count_.load(std::memory_order_relaxed);
  }

 private:
  absl::Status Fail(absl::string_view what) {
    state_ = Failed(absl::StrCat(description_, ": ", what));
    return state_;
  }

  /// Waits for a report of a state.
  absl::Status Await(DeviceReport::State state, milliseconds limit) {
    const nanoseconds deadline = clock_.Monotonic() + limit;
    while (state_.ok()) {
      const auto left = std::chrono::ceil<milliseconds>(deadline - clock_.Monotonic());
      if (left.count() <= 0) return Fail(absl::StrCat("no answer within ", limit.count(), " ms"));
      const std::optional<DeviceReport> report = socket_.Receive(left);
      if (report) Take(*report);
      if (report && report->state == state) break;
      if (!report && process_->Reap()) return Fail("its process has ended");
    }
    return state_;
  }

  void Take(const DeviceReport& report) {
    last_report_ = clock_.Monotonic();
    if (report.state == DeviceReport::State::kFailed) {
      state_ = absl::Status(report.code, report.text.data());
      return;
    }
    if (report.state == DeviceReport::State::kOpen) description_ = report.text.data();
    latency_s_.store(report.latency_s, std::memory_order_relaxed);
    xrun_count_.store(report.xrun_count, std::memory_order_relaxed);
    lost_frame_count_.store(report.lost_frame_count, std::memory_order_relaxed);
  }

  Clock& clock_;
  ReportSocket socket_;
  std::optional<ChildProcess> process_;
  std::string description_ = "the sound card";
  absl::Status state_;
  nanoseconds last_report_{0};
  std::atomic<double> latency_s_{0};
  std::atomic<uint64_t> xrun_count_{0};
  std::atomic<uint64_t> lost_frame_count_{0};
};

}  // namespace

absl::StatusOr<std::unique_ptr<AudioDevice>> OpenDeviceProcess(const std::string& program,
                                                               absl::string_view name,
                                                               const DeviceFormat& format,
                                                               Clock& clock) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Failed(absl::StrCat("no socket for ", program, ": ", std::strerror(errno)));
  }
  ReportSocket ours(ends[0]);
  ReportSocket theirs(ends[1]);
  ASSIGN_OR_RETURN(
      ChildProcess process,
      ChildProcess::Start(
          {.words = {program, std::string(name), absl::StrCat(format.sample_rate_hz),
                     absl::StrCat(format.block_frame_count), absl::StrCat(format.channel_count)},
           .input = ends[1]}));
  theirs.Close();
  auto device = std::make_unique<DeviceProcess>(std::move(ours), std::move(process), clock);
  RETURN_IF_ERROR(device->AwaitOpen());
  return device;
}

}  // namespace carillon
