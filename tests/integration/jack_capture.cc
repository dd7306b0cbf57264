// SPDX-License-Identifier: Apache-2.0
#include "tests/integration/jack_capture.h"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"

namespace carillon {
namespace {

constexpr double kSettleS = 0.3;

/// From JACK's microseconds to CLOCK_MONOTONIC: the closest of some readings of both.
double ClockOffsetS() {
  double best_gap_s = 1, offset_s = 0;
  for (int i = 0; i < 100; ++i) {
    const double before_s = MonotonicSeconds();
    const double jack_s = 1e-6 * static_cast<double>(jack_get_time());
    const double gap_s = MonotonicSeconds() - before_s;
    if (gap_s >= best_gap_s) continue;
    best_gap_s = gap_s;
    offset_s = before_s + gap_s / 2 - jack_s;
  }
  return offset_s;
}

}  // namespace

double MonotonicSeconds() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

absl::StatusOr<std::unique_ptr<JackCapture>> JackCapture::Start(const std::string& port,
                                                                double seconds) {
  jack_status_t status{};
  jack_client_t* client = jack_client_open("carillon-capture", JackNoStartServer, &status);
  if (client == nullptr) return absl::UnavailableError("no JACK server runs");
  std::unique_ptr<JackCapture> capture(new JackCapture(client));
  if (absl::Status started = capture->Record(port, seconds); !started.ok()) return started;
  return capture;
}

JackCapture::JackCapture(jack_client_t* client)
    : client_(client), sample_rate_hz_(jack_get_sample_rate(client)) {}

JackCapture::~JackCapture() {
  Stop();
  jack_client_close(client_);
}

absl::Status JackCapture::Record(const std::string& port, double seconds) {
  input_ = jack_port_register(client_, "in", JACK_DEFAULT_AUDIO_TYPE, JackPortIsInput, 0);
  samples_.resize(static_cast<size_t>(seconds * sample_rate_hz_));
  cycles_.resize(samples_.size() / jack_get_buffer_size(client_) + 1);
  clock_offset_s_ = ClockOffsetS();
  const auto process = [](jack_nframes_t frame_count, void* self) {
    return static_cast<JackCapture*>(self)->Process(frame_count);
  };
  jack_set_process_callback(client_, process, this);
  const auto count_xrun = [](void* self) {
    static_cast<JackCapture*>(self)->told_xrun_count_.fetch_add(1, std::memory_order_relaxed);
    return 0;
  };
  jack_set_xrun_callback(client_, count_xrun, this);
  if (jack_activate(client_) != 0 ||
      jack_connect(client_, port.c_str(), jack_port_name(input_)) != 0) {
    return absl::UnavailableError(absl::StrCat("JACK has no port ", port));
  }
  jack_latency_range_t latency{};
  jack_port_get_latency_range(jack_port_by_name(client_, port.c_str()), JackPlaybackLatency,
                              &latency);
  playback_latency_s_ = static_cast<double>(latency.max) / sample_rate_hz_;
  // A client that joins makes the server itself miss cycles.
  while (static_cast<double>(frame_count()) < kSettleS * sample_rate_hz_) usleep(1000);
  missed_count_ = missed_frame_count_ = told_xrun_count_ = 0;
  return absl::OkStatus();
}

int JackCapture::Process(jack_nframes_t frame_count) {
  jack_nframes_t jack_frame = 0;
  jack_time_t begin_us = 0, next_us = 0;
  float period_us = 0;
  jack_get_cycle_times(client_, &jack_frame, &begin_us, &next_us, &period_us);
  const uint64_t recorded = frame_count_.load(std::memory_order_relaxed);
  if (recorded > 0 && jack_frame != next_jack_frame_) {
    missed_count_.fetch_add(1, std::memory_order_relaxed);
    // A late client may be run twice in one cycle: its frames then come back.
    missed_frame_count_.fetch_add(static_cast<int32_t>(jack_frame - next_jack_frame_),
                                  std::memory_order_relaxed);
  }
  next_jack_frame_ = jack_frame + frame_count;
  if (recorded + frame_count > samples_.size() || cycle_count_ == cycles_.size()) return 0;
  const auto* input = static_cast<const float*>(jack_port_get_buffer(input_, frame_count));
  std::copy_n(input, frame_count, samples_.data() + recorded);
  cycles_[cycle_count_++] = {.first_frame = recorded,
                             .begin_s = 1e-6 * static_cast<double>(begin_us) + clock_offset_s_};
  frame_count_.store(recorded + frame_count, std::memory_order_release);
  return 0;
}

void JackCapture::Stop() { jack_deactivate(client_); }

double JackCapture::TimeOf(uint64_t frame) const {
  const auto end = cycles_.begin() + static_cast<ptrdiff_t>(cycle_count_);
  const auto after = std::upper_bound(cycles_.begin(), end, frame,
                                      [](uint64_t f, const Cycle& c) { return f < c.first_frame; });
  const Cycle& cycle = *(after - 1);
  return cycle.begin_s + static_cast<double>(frame - cycle.first_frame) / sample_rate_hz_;
}

double JackCapture::ClockErrorS() const {
  double least_s = INFINITY, most_s = -INFINITY;
  for (size_t i = 0; i < cycle_count_; ++i) {
    const double lead_s =
        cycles_[i].begin_s - static_cast<double>(cycles_[i].first_frame) / sample_rate_hz_;
    least_s = std::min(least_s, lead_s);
    most_s = std::max(most_s, lead_s);
  }
  return cycle_count_ == 0 ? 0 : most_s - least_s;
}

double JackCapture::ClockPpm() const {
  if (cycle_count_ < 2) return 0;
  const Cycle& last = cycles_[cycle_count_ - 1];
  const double seconds = last.begin_s - cycles_.front().begin_s;
  return 1e6 * (static_cast<double>(last.first_frame) / sample_rate_hz_ / seconds - 1);
}

}  // namespace carillon
