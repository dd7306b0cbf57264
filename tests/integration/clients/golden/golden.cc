// SPDX-License-Identifier: Apache-2.0
//
// The golden scene in C++: writes its trace, renders it, and writes the samples.
// Usage: golden SERVER MODEL TRACE SAMPLES

#include <carillon/client.h>
#include <google/protobuf/text_format.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

namespace {

using carillon::client::ContactTraceReader;
using carillon::client::ContactTraceWriter;

constexpr double kStepS = 1.0 / 64;
constexpr const char* kHeader = R"pb(simulator: "golden" step_s: 0.015625 frame: FRAME_OBJECT)pb";
constexpr const char* kLow = R"pb(
  handle: 1
  material { preset: "chime_aluminum" }
  radiation: RADIATION_MODEL_PAPER_COUPLING
  label: "low"
  size: 2
  gain: 1
)pb";
constexpr const char* kHigh = R"pb(
  handle: 2
  material { preset: "chime_aluminum" }
  radiation: RADIATION_MODEL_PAPER_COUPLING
  label: "high"
  size: 1
  gain: 0.5
  pose {
    position_m { x: 1 z: 0.5 }
    orientation { y: 1 }
  }
)pb";
constexpr const char* kKnock = R"pb(
  contact_columns {
    kind: CONTACT_KIND_IMPACT
    object: 1
    point_m: [ 0, 0.008, 0.02 ]
    impulse_newton_seconds: [ 0, 0.125, -0.25 ]
    hertz { striker: "wood" }
  }
)pb";
/// What an engine reports in a step: the low bar rests, and the high one slides.
constexpr const char* kSlide = R"pb(
  contact_columns {
    kind: CONTACT_KIND_REPORTED
    object: [ 1, 2 ]
    point_m: [ 0.125, 0.016, 0, 0.0625, 0, 0.01 ]
    impulse_newton_seconds: [ 0, 0, 0.0625, 0, 0, -0.03125 ]
    normal: [ 0, 0, 1, 0, 0, 0 ]
    partner: [ 0, 9 ]
    travel_speed_m_per_s: [ 0, 0.5 ]
    roughness_depth: 0.25
    irregularity_length_m: 0.001
  }
)pb";
constexpr const char* kPause = R"pb(time_s: 0.25 time_scale: 0)pb";
constexpr const char* kCollision = R"pb(
  time_s: 0.5
  time_scale: 0.5
  contact_columns {
    kind: CONTACT_KIND_IMPACT
    object: 1
    point_m: [ 0.25, 0, 0.01 ]
    impulse_newton_seconds: [ 0, 0.5, 0 ]
    duration_s: 0.0009765625
    time_offset_s: 0.0078125
    second_object: 2
    second_point_m: [ 0, 0, 0 ]
  }
)pb";

template <typename Message>
Message Parse(const char* text) {
  Message message;
  if (!google::protobuf::TextFormat::ParseFromString(text, &message)) std::abort();
  return message;
}

absl::Status WriteTrace(const std::string& model, const std::string& file) {
  auto trace = ContactTraceWriter::Create(file, Parse<carillon::v1::ContactTraceHeader>(kHeader));
  if (!trace.ok()) return trace.status();
  absl::Status written;
  for (const char* text : {kLow, kHigh}) {
    auto bar = Parse<carillon::v1::ContactTraceObject>(text);
    bar.set_modal_model(model);
    trace->Write(bar);
  }
  written.Update(trace->Write(Parse<carillon::v1::ContactStep>(kKnock)));
  for (int number = 1; number <= 16; ++number) {
    auto slide = Parse<carillon::v1::ContactStep>(kSlide);
    slide.set_time_s(number * kStepS);
    slide.mutable_contact_columns(0)->set_impulse_newton_seconds(4,
                                                                 static_cast<float>(number) / 256);
    written.Update(trace->Write(slide));
  }
  for (const char* text : {kPause, kCollision}) {
    written.Update(trace->Write(Parse<carillon::v1::ContactStep>(text)));
  }
  written.Update(trace->Close());
  return written;
}

absl::Status Render(const std::string& server, const std::string& trace_file,
                    const std::string& samples_file) {
  absl::StatusOr<ContactTraceReader> trace = ContactTraceReader::Open(trace_file);
  if (!trace.ok()) return trace.status();
  carillon::v1::RenderSettings settings;
  settings.set_tail_s(0.5);
  settings.set_channel_count(2);
  std::ofstream out(samples_file, std::ios::binary);
  const auto write = [&out](const carillon::client::AudioBlock& block) {
    const auto bytes = std::as_bytes(block.samples);
    return out.write(reinterpret_cast<const char*>(bytes.data()), bytes.size()).good();
  };
  return carillon::client::Connect(server)->Render(settings, *trace, write).status();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  absl::Status status = WriteTrace(argv[2], argv[3]);
  if (status.ok()) status = Render(argv[1], argv[3], argv[4]);
  if (!status.ok()) std::cerr << status << '\n';
  return status.ok() ? 0 : 1;
}
