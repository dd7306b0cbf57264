// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <jack/jack.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace carillon {

/// A JACK client that records one port of another, and when each of its cycles began. The process
/// callback only copies into memory that was taken before.
class JackCapture {
 public:
  /// A cycle: frames [first_frame, next cycle's) of the recording.
  struct Cycle {
    uint64_t first_frame = 0;
    double begin_s = 0;  ///< of CLOCK_MONOTONIC, as JACK's loop has smoothed it
  };

  /// Records `port` for at most `seconds` from now on; returns when the server has settled after
  /// the new client. Errors: Unavailable.
  static absl::StatusOr<std::unique_ptr<JackCapture>> Start(const std::string& port,
                                                            double seconds);
  ~JackCapture();
  JackCapture(const JackCapture&) = delete;
  JackCapture& operator=(const JackCapture&) = delete;

  /// Ends the recording; it may be read from now on.
  void Stop();

  std::span<const float> samples() const { return {samples_.data(), frame_count_.load()}; }
  uint32_t sample_rate_hz() const { return sample_rate_hz_; }

  /// Frames recorded so far.
  uint64_t frame_count() const { return frame_count_.load(); }

  /// When a frame left its client, seconds of CLOCK_MONOTONIC.
  double TimeOf(uint64_t frame) const;

  /// By how much JACK's clock ran fast against CLOCK_MONOTONIC, parts in a million.
  double ClockPpm() const;

  /// How far JACK's clock strayed from one of constant rate within the recording, seconds: a server
  /// that stood still and caught up has missed no cycle, but told wrong times meanwhile.
  double ClockErrorS() const;

  /// Cycles that JACK or this client missed since Start returned.
  uint64_t missed_count() const { return missed_count_.load(); }

  /// Frames of those cycles, as JACK counts them.
  int64_t missed_frame_count() const { return missed_frame_count_.load(); }

  /// Times that JACK has told of an xrun since, whoever was late; of one that made several clients
  /// late it tells for each.
  uint64_t told_xrun_count() const { return told_xrun_count_.load(); }

  /// From the port to the ear as JACK states it, seconds.
  double playback_latency_s() const { return playback_latency_s_; }

 private:
  explicit JackCapture(jack_client_t* client);
  absl::Status Record(const std::string& port, double seconds);
  int Process(jack_nframes_t frame_count);

  jack_client_t* client_;
  jack_port_t* input_ = nullptr;
  uint32_t sample_rate_hz_;
  double playback_latency_s_ = 0;
  double clock_offset_s_ = 0;  // from JACK's clock to CLOCK_MONOTONIC
  std::vector<float> samples_;
  std::vector<Cycle> cycles_;
  size_t cycle_count_ = 0;
  jack_nframes_t next_jack_frame_ = 0;
  std::atomic<uint64_t> frame_count_{0};
  std::atomic<uint64_t> missed_count_{0};
  std::atomic<int64_t> missed_frame_count_{0};
  std::atomic<uint64_t> told_xrun_count_{0};
};

/// Seconds of CLOCK_MONOTONIC.
double MonotonicSeconds();

}  // namespace carillon
