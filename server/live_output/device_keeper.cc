// SPDX-License-Identifier: Apache-2.0
#include "server/live_output/device_keeper.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon {
namespace {

constexpr std::chrono::milliseconds kCheckPeriod(20);
/// The period while the null device plays in place of the wanted one, and needs no check.
constexpr std::chrono::milliseconds kNullPeriod(100);
/// A sound server that has come back plays after at most this period and the time to open a device.
constexpr std::chrono::milliseconds kTryPeriod(500);
/// The longest period while there has never been a sound card: each attempt starts a process.
constexpr std::chrono::seconds kRareTryPeriod(10);

/// Returns whether a device that cannot be opened may appear later. A file that cannot be written
/// and a meaningless specification are errors of the configuration.
bool MayAppear(const absl::Status& status) {
  return absl::IsNotFound(status) || absl::IsUnavailable(status) ||
         absl::IsResourceExhausted(status);
}

std::string NoSound(const absl::Status& status) {
  return absl::StrCat("no sound: ", ToErrorInfo(status).message());
}

}  // namespace

absl::StatusOr<std::unique_ptr<DeviceKeeper>> DeviceKeeper::Start(const DeviceSettings& settings,
                                                                  FrameSource& source, Clock& clock,
                                                                  Log log, Wake wake) {
  std::unique_ptr<DeviceKeeper> keeper(
      new DeviceKeeper(settings, source, clock, std::move(log), std::move(wake)));
  RETURN_IF_ERROR(keeper->Begin());
  return keeper;
}

DeviceKeeper::DeviceKeeper(const DeviceSettings& settings, FrameSource& source, Clock& clock,
                           Log log, Wake wake)
    : settings_(settings),
      source_(source),
      clock_(clock),
      log_(std::move(log)),
      wake_(std::move(wake)),
      try_period_(kTryPeriod),
      missed_(settings.specification != "auto") {}

DeviceKeeper::~DeviceKeeper() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  const MutexLock lock(&mutex_);
  if (device_) device_->Stop();
}

absl::Status DeviceKeeper::Begin() {
  absl::StatusOr<std::unique_ptr<AudioDevice>> wanted = OpenDevice(settings_, clock_);
  absl::Status status = wanted.status();
  if (status.ok()) status = (*wanted)->Start(source_);
  if (!status.ok() && !MayAppear(status)) return status;
  if (status.ok()) {
    const bool needs_no_keeper = (*wanted)->discards();
    Install(*std::move(wanted), true);
    if (needs_no_keeper) return absl::OkStatus();
  } else {
    std::unique_ptr<AudioDevice> null = OpenNullDevice(settings_.format, clock_);
    RETURN_IF_ERROR(null->Start(source_));
    Install(std::move(null), false);
    Note(NoSound(status));
  }
  thread_ = std::thread([this] { Run(); });
  return absl::OkStatus();
}

DeviceState DeviceKeeper::state() const {
  const MutexLock lock(&mutex_);
  return {.description = device_->description(),
          .message = message_,
          .plays = plays(),
          .latency_s = device_->latency_s(),
          .xrun_count = earlier_xrun_count_ + device_->xrun_count(),
          .lost_frame_count = earlier_lost_frame_count_ + device_->lost_frame_count()};
}

void DeviceKeeper::Observe(Observer observer) {
  const MutexLock lock(&observer_mutex_);
  observer_ = std::move(observer);
  if (observer_) observer_(state().plays);
}

void DeviceKeeper::Run() {
  while (!stopping_) {
    CheckDevice();
    const auto period = device().discards() ? kNullPeriod : kCheckPeriod;
    clock_.SleepUntil(clock_.Monotonic() + period);
  }
}

void DeviceKeeper::CheckDevice() {
  absl::Status status;
  bool wanted = false;
  {
    const MutexLock lock(&mutex_);
    status = device_->Check();
    wanted = wanted_;
  }
  if (!wanted) return TryWanted();
  if (absl::IsUnavailable(status)) {
    const MutexLock lock(&change_mutex_);
    PlayOnNull();
  }
  Note(status.ok() ? "" : ToErrorInfo(status).message());
}

/// Stops the present device before another starts, because two devices must not pull from the
/// source at the same time.
void DeviceKeeper::PlayOnNull() {
  std::unique_ptr<AudioDevice> null = OpenNullDevice(settings_.format, clock_);
  device().Stop();
  null->Start(source_).IgnoreError();  // a null device always starts
  Install(std::move(null), false);
}

void DeviceKeeper::TryWanted() {
  if (clock_.Monotonic() < next_try_) return;
  absl::StatusOr<std::unique_ptr<AudioDevice>> device = OpenDevice(settings_, clock_);
  next_try_ = clock_.Monotonic() + try_period_;
  if (!device.ok()) {
    const MutexLock lock(&mutex_);
    if (!missed_) try_period_ = std::min<std::chrono::nanoseconds>(2 * try_period_, kRareTryPeriod);
    message_ = NoSound(device.status());  // not logged, because it may change with each attempt
    return;
  }
  try_period_ = kTryPeriod;
  if (wake_) wake_();
  PlayOnWanted(*std::move(device));
}

void DeviceKeeper::PlayOnWanted(std::unique_ptr<AudioDevice> wanted) {
  {
    const MutexLock lock(&change_mutex_);
    device().Stop();
    if (!wanted->Start(source_).ok()) {
      wanted.reset();
      return PlayOnNull();
    }
    Install(std::move(wanted), true);
  }
  Note("");
}

bool DeviceKeeper::Pause() {
  const MutexLock lock(&change_mutex_);
  if (!device().discards()) return false;
  device().Stop();
  paused_ = true;
  return true;
}

void DeviceKeeper::Resume() {
  const MutexLock lock(&change_mutex_);
  if (!std::exchange(paused_, false)) return;
  device().Start(source_).IgnoreError();  // a null device always starts
}

/// Returns the present device. It stays while change_mutex_ is held, and on the keeper's thread,
/// which alone replaces it. mutex_ is not held while the device stops, because that takes up to
/// half a second.
AudioDevice& DeviceKeeper::device() const {
  const MutexLock lock(&mutex_);
  return *device_;
}

void DeviceKeeper::Install(std::unique_ptr<AudioDevice> device, bool wanted) {
  const MutexLock lock(&mutex_);
  if (device_) {
    earlier_xrun_count_ += device_->xrun_count();
    earlier_lost_frame_count_ += device_->lost_frame_count();
  }
  device_ = std::move(device);
  wanted_ = wanted;
  missed_ |= wanted;
}

/// Stores a fault, or with an empty message its end. Logs each change.
void DeviceKeeper::Note(const std::string& message) {
  std::string line;
  bool plays_now = false;
  {
    const MutexLock lock(&mutex_);
    if (message == message_) return;
    message_ = message;
    line = message.empty() ? absl::StrCat(device_->description(), " plays again") : message;
    plays_now = plays();
  }
  log_(line);
  const MutexLock lock(&observer_mutex_);
  if (observer_) observer_(plays_now);
}

}  // namespace carillon
