// SPDX-License-Identifier: Apache-2.0
// strike_latency SERVER MODEL PORT WAY STREAMS STRIKES: strikes an object of a daemon that plays
// through JACK, and measures on one clock how long each strike takes from the client to its first
// sample in a capture of the daemon's port. WAY: "stream" (time stamps of now, the usual delay),
// "ahead" (the same, sent 50 ms before), "arrival" (no delay).
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/client.h"
#include "tests/integration/jack_capture.h"

namespace carillon {
namespace {

/// Damping that lets every mode die within 10 ms, down to the frame where the bank falls asleep and
/// all samples are zero: so each strike's first sample is the first that is not.
constexpr double kAlpha2PerS = 4000;
constexpr double kShortestGapS = 0.014;
constexpr double kLongestGapS = 0.030;
/// All of these must be zero before a first sample.
constexpr size_t kQuietFrames = 48;
constexpr double kStepS = 0.005;
constexpr double kAheadS = 0.05;

struct Arguments {
  std::string server, model, port, way;
  int stream_count = 0;
  int strike_count = 0;
};

/// What is known of a stream: its strikes' time stamps, and how the daemon says it maps them.
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

absl::StatusOr<v1::SoundingObject> AddObject(const client::Client& daemon, const std::string& scene,
                                             const std::string& model) {
  v1::AddObjectsRequest request;
  request.set_scene(scene);
  v1::NewObject& object = *request.add_objects();
  object.set_modal_model(model);
  object.mutable_material()->set_preset("chime_aluminum");
  object.mutable_material()->set_alpha2_per_s(kAlpha2PerS);
  const auto added = daemon.AddObjects(request);
  if (!added.ok()) return added.status();
  return added->front();
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

absl::StatusOr<Stream> Strike(const client::Client& daemon, const std::string& scene,
                              uint32_t object, const Arguments& arguments, std::mt19937& random) {
  v1::ContactStreamStart start;
  start.set_scene(scene);
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
    absl::Status sent = (*contacts)->Send(MakeStep(stamp_s, object));
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

/// First samples of all strikes in a capture that was silent before.
std::vector<uint64_t> FindOnsets(std::span<const float> samples) {
  std::vector<uint64_t> onsets;
  size_t quiet_count = kQuietFrames;
  for (size_t frame = 0; frame < samples.size(); ++frame) {
    if (samples[frame] != 0 && quiet_count >= kQuietFrames) onsets.push_back(frame);
    quiet_count = samples[frame] == 0 ? quiet_count + 1 : 0;
  }
  return onsets;
}

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::ranges::sort(values);
  return values[static_cast<size_t>(std::ceil(share * static_cast<double>(values.size() - 1)))];
}

/// Where in the mixer's frames a strike is first heard: the sine begins at zero.
double FirstHeardFrame(const Stream& stream, double stamp_s, double rate_hz) {
  return std::floor(static_cast<double>(stream.report.first_frame()) +
                    (stamp_s + stream.report.scheduling_delay_s()) * rate_hz) +
         1;
}

/// A strike as it was sent, and where its stream says that it is first heard.
struct SentStrike {
  const Stream* stream;
  double stamp_s = 0;
  double mixer_frame = 0;
};

std::vector<SentStrike> AllStrikes(const std::vector<Stream>& streams, double rate_hz) {
  std::vector<SentStrike> strikes;
  for (const Stream& stream : streams) {
    for (const double stamp_s : stream.stamps_s) {
      strikes.push_back({&stream, stamp_s, FirstHeardFrame(stream, stamp_s, rate_hz)});
    }
  }
  return strikes;
}

/// From the mixer's frames to the capture's: what most strikes agree on.
double FindShift(const std::vector<SentStrike>& strikes, const std::vector<uint64_t>& onsets) {
  constexpr size_t kReach = 16;  // strikes that ran together are one onset
  std::map<double, int> votes;
  for (size_t i = 0; i < strikes.size(); ++i) {
    for (size_t k = i - std::min(i, kReach); k < std::min(i + 1, onsets.size()); ++k) {
      ++votes[static_cast<double>(onsets[k]) - strikes[i].mixer_frame];
    }
  }
  const auto most =
      std::ranges::max_element(votes, {}, [](const auto& vote) { return vote.second; });
  return most == votes.end() ? 0 : most->first;
}

struct Findings {
  std::vector<double> latencies_s;
  uint64_t in_place_count = 0;   ///< to the sample where the daemon says
  uint64_t displaced_count = 0;  ///< heard later
  uint64_t unheard_count = 0;    ///< ran together with another
  double most_over_s = -1;       ///< of those in place: latency beyond what is stated
};

Findings Compare(const std::vector<SentStrike>& strikes, const std::vector<uint64_t>& onsets,
                 const JackCapture& capture, double stated_output_s) {
  const double shift = FindShift(strikes, onsets);
  Findings found;
  auto onset = onsets.begin();
  for (size_t i = 0; i < strikes.size(); ++i) {
    const auto [stream, stamp_s, mixer_frame] = strikes[i];
    const double due = mixer_frame + shift;
    onset = std::find_if(onset, onsets.end(),
                         [&](uint64_t frame) { return static_cast<double>(frame) >= due; });
    const double next_due = i + 1 < strikes.size() ? strikes[i + 1].mixer_frame + shift : INFINITY;
    if (onset == onsets.end() || static_cast<double>(*onset) >= next_due) {
      ++found.unheard_count;
      continue;
    }
    const double latency_s = capture.TimeOf(*onset) - (stream->first_s + stamp_s);
    found.latencies_s.push_back(latency_s);
    if (static_cast<double>(*onset) > due) {
      ++found.displaced_count;
      continue;
    }
    ++found.in_place_count;
    const double arrival_s = stream->arrived_s - stream->first_s;
    found.most_over_s =
        std::max(found.most_over_s,
                 latency_s - stream->report.scheduling_delay_s() - stated_output_s - arrival_s);
  }
  return found;
}

void Print(const Arguments& arguments, const std::vector<Stream>& streams,
           const JackCapture& capture, const v1::GetMixerResponse& before,
           const v1::GetMixerResponse& after) {
  const double stated_output_s = after.output_latency_s() - capture.playback_latency_s();
  const std::vector<SentStrike> strikes = AllStrikes(streams, capture.sample_rate_hz());
  const Findings found = Compare(strikes, FindOnsets(capture.samples()), capture, stated_output_s);
  uint64_t late_count = 0;
  for (const Stream& stream : streams) late_count += stream.report.late_count();
  std::printf(
      "{\"way\": \"%s\", \"delay_ms\": %.3f, \"output_ms\": %.3f, \"beyond_capture_ms\": %.3f",
      arguments.way.c_str(), 1e3 * streams.front().report.scheduling_delay_s(),
      1e3 * after.output_latency_s(), 1e3 * capture.playback_latency_s());
  const std::pair<const char*, double> quantiles[] = {
      {"least", 0}, {"p50", 0.5}, {"p99", 0.99}, {"p999", 0.999}, {"most", 1}};
  for (const auto& [name, share] : quantiles) {
    std::printf(", \"%s_ms\": %.3f", name, 1e3 * Quantile(found.latencies_s, share));
  }
  std::printf(
      ", \"most_over_ms\": %.3f, \"shortest_gap_ms\": %.3f, \"clock_ppm\": %.1f, "
      "\"clock_error_ms\": %.3f",
      1e3 * found.most_over_s, 1e3 * kShortestGapS, capture.ClockPpm(), 1e3 * capture.ClockErrorS());
  const std::pair<const char*, uint64_t> counts[] = {
      {"strikes", strikes.size()},
      {"late", late_count},
      {"in_place", found.in_place_count},
      {"displaced", found.displaced_count},
      {"unheard", found.unheard_count},
      {"missed_cycles", capture.missed_count()},
      {"xruns", after.xrun_count() - before.xrun_count()},
      {"lost_frames", after.lost_frame_count() - before.lost_frame_count()}};
  for (const auto& [name, count] : counts) {
    std::printf(", \"%s\": %llu", name, static_cast<unsigned long long>(count));
  }
  std::printf("}\n");
}

absl::Status Measure(const Arguments& arguments) {
  const std::unique_ptr<client::Client> connection = client::Connect(arguments.server);
  const client::Client& daemon = *connection;
  const auto created = daemon.CreateScene();
  if (!created.ok()) return created.status();
  const std::string& scene = created->name();
  const auto object = AddObject(daemon, scene, arguments.model);
  if (!object.ok()) return object.status();
  const double longest_s =
      arguments.stream_count * (2 + kLongestGapS * (arguments.strike_count + 1)) + 1;
  const auto capture = JackCapture::Start(arguments.port, longest_s);
  if (!capture.ok()) return capture.status();
  const auto before = daemon.GetMixer();
  if (!before.ok()) return before.status();
  std::mt19937 random(1);
  std::vector<Stream> streams;
  for (int i = 0; i < arguments.stream_count; ++i) {
    auto stream = Strike(daemon, scene, object->handle(), arguments, random);
    if (!stream.ok()) return stream.status();
    streams.push_back(*std::move(stream));
  }
  (*capture)->Stop();
  const auto mixer = daemon.GetMixer();
  if (!mixer.ok()) return mixer.status();
  Print(arguments, streams, **capture, *before, *mixer);
  return daemon.DeleteScene(scene);
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) {
  if (argc != 7) return EXIT_FAILURE;
  const absl::Status status = carillon::Measure({.server = argv[1],
                                                 .model = argv[2],
                                                 .port = argv[3],
                                                 .way = argv[4],
                                                 .stream_count = std::atoi(argv[5]),
                                                 .strike_count = std::atoi(argv[6])});
  if (!status.ok()) std::cerr << status.message() << '\n';
  return status.ok() ? EXIT_SUCCESS : EXIT_FAILURE;
}
