// SPDX-License-Identifier: Apache-2.0
// record_jack PORT SECONDS FILE [SERVER SCENE OBJECT WAY STREAMS STRIKES]: records a JACK port as
// raw 32-bit floats. The program prints "recording" when it begins to record, and at the end prints
// as JSON what it missed. It ends when standard input ends, or after SECONDS. With SERVER it
// strikes an object of a daemon instead, STRIKES times in each of STREAMS streams, and ends after
// the last strike. WAY: "stream" (time stamps of now, the usual delay), "ahead" (the same, sent 50
// ms before), "arrival" (no delay). The JSON then also has the time of each strike and the
// beginning of each cycle of JACK, on one clock, from which jack.py computes latencies.
#include <jack/jack.h>
#include <poll.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "carillon/client.h"

namespace carillon {
namespace {

constexpr double kSettleS = 0.3;
constexpr double kShortestGapS = 0.014;
constexpr double kLongestGapS = 0.030;
constexpr double kStepS = 0.005;
constexpr double kAheadS = 0.05;

double MonotonicSeconds() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

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

/// A JACK client that records one port of another, and when each of its cycles began. The process
/// callback only copies into memory that was taken before.
class JackCapture {
 public:
  /// A cycle: frames [first_frame, next cycle's) of the recording.
  struct Cycle {
    uint64_t first_frame = 0;
    double begin_s = 0;  ///< of CLOCK_MONOTONIC, as JACK's loop has smoothed it
  };

  explicit JackCapture(jack_client_t* client)
      : client_(client), sample_rate_hz_(jack_get_sample_rate(client)) {}
  ~JackCapture() {
    Stop();
    jack_client_close(client_);
  }
  JackCapture(const JackCapture&) = delete;
  JackCapture& operator=(const JackCapture&) = delete;

  /// Records `port` for at most `seconds` from now on; returns when the server has settled after
  /// the new client. Errors: Unavailable.
  absl::Status Record(const std::string& port, double seconds);

  /// Ends the recording; it may be read from now on.
  void Stop() { jack_deactivate(client_); }

  /// Writes the recording; returns whether that succeeded.
  bool Write(const char* file) const {
    std::ofstream out(file, std::ios::binary);
    out.write(reinterpret_cast<const char*>(samples_.data()),
              static_cast<std::streamsize>(frame_count_ * sizeof(float)));
    return out.good();
  }

  std::vector<Cycle> cycles() const {
    return {cycles_.begin(), cycles_.begin() + static_cast<ptrdiff_t>(cycle_count_)};
  }

  /// Returns what the client recorded, and what JACK or this client missed meanwhile: cycles, their
  /// frames as JACK counts them, and xruns. JACK reports an xrun once for each client that
  /// it made late.
  std::string ToJson() const;

 private:
  int Process(jack_nframes_t frame_count);

  jack_client_t* client_;
  jack_port_t* input_ = nullptr;
  uint32_t sample_rate_hz_;
  double playback_latency_s_ = 0;  // from the port to the ear as JACK states it
  double clock_offset_s_ = 0;      // from JACK's clock to CLOCK_MONOTONIC
  std::vector<float> samples_;
  std::vector<Cycle> cycles_;
  size_t cycle_count_ = 0;
  jack_nframes_t next_jack_frame_ = 0;
  std::atomic<uint64_t> frame_count_{0};
  std::atomic<uint64_t> missed_count_{0};
  std::atomic<int64_t> missed_frame_count_{0};
  std::atomic<uint64_t> told_xrun_count_{0};
};

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
  while (static_cast<double>(frame_count_) < kSettleS * sample_rate_hz_) usleep(1000);
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

std::string JackCapture::ToJson() const {
  return absl::StrCat("\"frames\": ", frame_count_.load(),
                      ", \"sample_rate_hz\": ", sample_rate_hz_,
                      ", \"beyond_capture_s\": ", playback_latency_s_,
                      ", \"missed_cycles\": ", missed_count_.load(),
                      ", \"missed_frames\": ", missed_frame_count_.load(),
                      ", \"told_xruns\": ", told_xrun_count_.load());
}

struct Arguments {
  std::string server, scene, way;
  uint32_t object = 0;
  int stream_count = 0;
  int strike_count = 0;
};

/// A stream: the time stamps of its strikes, and how the daemon maps them to its own frames.
struct Stream {
  double first_s = 0;    ///< CLOCK_MONOTONIC, of its first step; time stamps count from here
  double arrived_s = 0;  ///< when the client knew that the daemon had taken that
  std::vector<double> stamps_s;
  v1::StreamContactsResponse report;
};

void SleepUntil(double time_s) {
  timespec until{.tv_sec = static_cast<time_t>(time_s), .tv_nsec = 0};
  until.tv_nsec = static_cast<int64_t>(1e9 * (time_s - static_cast<double>(until.tv_sec)));
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) != 0) {
  }
}

v1::ContactStep MakeStep(double time_s, uint32_t object) {
  v1::ContactStep step;
  step.set_time_s(time_s);
  v1::Contact& impulse = *step.add_contacts();
  impulse.set_kind(v1::CONTACT_KIND_IMPACT);
  impulse.set_object(object);
  impulse.mutable_surface_point()->set_weight1(0.3);
  impulse.mutable_surface_point()->set_weight2(0.2);
  impulse.mutable_impulse_newton_seconds()->set_x(0.01);
  impulse.mutable_impulse_newton_seconds()->set_y(0.02);
  impulse.mutable_impulse_newton_seconds()->set_z(-0.03);
  return step;
}

/// An empty step fixes how time is mapped; returns when the daemon has answered that.
absl::Status Begin(client::ContactStream& contacts, Stream& stream) {
  stream.first_s = MonotonicSeconds();
  if (absl::Status sent = contacts.Send({}); !sent.ok()) return sent;
  while (!contacts.Report().has_first_frame()) SleepUntil(MonotonicSeconds() + 0.0005);
  stream.arrived_s = MonotonicSeconds();
  return absl::OkStatus();
}

absl::StatusOr<Stream> Strike(const client::Client& daemon, const Arguments& arguments,
                              std::mt19937& random) {
  v1::ContactStreamStart start;
  start.set_scene(arguments.scene);
  start.set_step_s(kStepS);
  if (arguments.way == "arrival") start.set_scheduling_delay_s(0);
  const auto contacts = daemon.StreamContacts(start);
  if (!contacts.ok()) return contacts.status();
  Stream stream;
  if (absl::Status begun = Begin(**contacts, stream); !begun.ok()) return begun;
  std::uniform_real_distribution<double> gap_s(kShortestGapS, kLongestGapS);
  double next_s = MonotonicSeconds() + kLongestGapS;
  for (int i = 0; i < arguments.strike_count; ++i) {
    SleepUntil(next_s);
    const double ahead_s = arguments.way == "ahead" ? kAheadS : 0;
    const double stamp_s = MonotonicSeconds() - stream.first_s + ahead_s;
    absl::Status sent = (*contacts)->Send(MakeStep(stamp_s, arguments.object));
    if (!sent.ok()) return sent;
    stream.stamps_s.push_back(stamp_s);
    next_s = MonotonicSeconds() + gap_s(random);
  }
  SleepUntil(MonotonicSeconds() + 0.2);  // the next stream begins in silence
  const auto report = (*contacts)->Finish();
  if (!report.ok()) return report.status();
  stream.report = *report;
  return stream;
}

absl::StatusOr<std::vector<Stream>> StrikeAll(const Arguments& arguments) {
  const std::unique_ptr<client::Client> daemon = client::Connect(arguments.server);
  std::mt19937 random(1);
  std::vector<Stream> streams;
  for (int i = 0; i < arguments.stream_count; ++i) {
    absl::StatusOr<Stream> stream = Strike(*daemon, arguments, random);
    if (!stream.ok()) return stream.status();
    streams.push_back(*stream);
  }
  return streams;
}

/// All digits of a number, most of which StrCat leaves out.
std::string Exact(double value) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.begin(), digits.end(), value).ptr};
}

std::string ToJson(const std::vector<Stream>& streams,
                   const std::vector<JackCapture::Cycle>& cycles) {
  const auto write_stamp = [](std::string* out, double stamp_s) { *out += Exact(stamp_s); };
  const auto write_stream = [&](std::string* out, const Stream& stream) {
    absl::StrAppend(out, "{\"first_s\": ", Exact(stream.first_s),
                    ", \"arrived_s\": ", Exact(stream.arrived_s),
                    ", \"first_frame\": ", stream.report.first_frame(),
                    ", \"scheduling_delay_s\": ", Exact(stream.report.scheduling_delay_s()),
                    ", \"late\": ", stream.report.late_count(), ", \"stamps_s\": [",
                    absl::StrJoin(stream.stamps_s, ", ", write_stamp), "]}");
  };
  const auto write_cycle = [](std::string* out, const JackCapture::Cycle& cycle) {
    absl::StrAppend(out, "[", cycle.first_frame, ", ", Exact(cycle.begin_s), "]");
  };
  return absl::StrCat("\"streams\": [", absl::StrJoin(streams, ", ", write_stream),
                      "], \"cycles\": [", absl::StrJoin(cycles, ", ", write_cycle), "]");
}

absl::Status Run(const char* port, double seconds, const char* file, const Arguments& arguments) {
  jack_client_t* client = jack_client_open("carillon-capture", JackNoStartServer, nullptr);
  if (client == nullptr) return absl::UnavailableError("no JACK server runs");
  JackCapture capture(client);
  if (absl::Status started = capture.Record(port, seconds); !started.ok()) return started;
  std::cout << "recording" << std::endl;
  absl::StatusOr<std::vector<Stream>> streams = StrikeAll(arguments);
  if (!streams.ok()) return streams.status();
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  if (streams->empty()) poll(&input, 1, static_cast<int>(1000 * seconds));
  capture.Stop();
  std::cout << "{" << capture.ToJson() << ", " << ToJson(*streams, capture.cycles()) << "}\n";
  return capture.Write(file) ? absl::OkStatus() : absl::UnavailableError(file);
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) {
  if (argc != 4 && argc != 10) return EXIT_FAILURE;
  carillon::Arguments arguments;
  if (argc == 10) {
    arguments = {.server = argv[4],
                 .scene = argv[5],
                 .way = argv[7],
                 .object = static_cast<uint32_t>(std::atoi(argv[6])),
                 .stream_count = std::atoi(argv[8]),
                 .strike_count = std::atoi(argv[9])};
  }
  const absl::Status status = carillon::Run(argv[1], std::atof(argv[2]), argv[3], arguments);
  if (!status.ok()) std::cerr << status.message() << '\n';
  return status.ok() ? EXIT_SUCCESS : EXIT_FAILURE;
}
