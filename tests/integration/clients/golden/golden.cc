// SPDX-License-Identifier: Apache-2.0
//
// The golden scene in C++: writes its trace, renders it, and writes the samples.
// Usage: golden SERVER MODEL TRACE SAMPLES

#include <carillon/client.h>

#include <fstream>
#include <initializer_list>
#include <iostream>
#include <string>

namespace {

using carillon::client::ContactTraceReader;
using carillon::client::ContactTraceWriter;

constexpr double kStepS = 1.0 / 64;

carillon::v1::ContactTraceHeader MakeHeader() {
  carillon::v1::ContactTraceHeader header;
  header.set_simulator("golden");
  header.set_step_s(kStepS);
  header.set_frame(carillon::v1::FRAME_OBJECT);
  return header;
}

carillon::v1::ContactTraceObject MakeBar(uint32_t handle, const std::string& model,
                                         const std::string& label) {
  carillon::v1::ContactTraceObject bar;
  bar.set_handle(handle);
  bar.set_modal_model(model);
  bar.mutable_material()->set_preset("chime_aluminum");
  bar.set_label(label);
  bar.set_radiation(carillon::v1::RADIATION_MODEL_PAPER_COUPLING);
  bar.set_size(1);
  bar.set_gain(1);
  return bar;
}

void WriteBars(const std::string& model, ContactTraceWriter& trace) {
  carillon::v1::ContactTraceObject low = MakeBar(1, model, "low");
  low.set_size(2);
  trace.Write(low);
  carillon::v1::ContactTraceObject high = MakeBar(2, model, "high");
  high.set_gain(0.5);
  high.mutable_pose()->mutable_position_m()->set_x(1);
  high.mutable_pose()->mutable_position_m()->set_z(0.5);
  high.mutable_pose()->mutable_orientation()->set_y(1);
  trace.Write(high);
}

struct Row {
  uint32_t object;
  std::initializer_list<float> point_m;
  std::initializer_list<float> impulse_newton_seconds;
};

void Add(const Row& row, carillon::v1::ContactColumns& columns) {
  columns.add_object(row.object);
  columns.mutable_point_m()->Add(row.point_m.begin(), row.point_m.end());
  columns.mutable_impulse_newton_seconds()->Add(row.impulse_newton_seconds.begin(),
                                                row.impulse_newton_seconds.end());
}

carillon::v1::ContactStep Knock() {
  carillon::v1::ContactStep step;
  carillon::v1::ContactColumns& impacts = *step.add_contact_columns();
  impacts.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
  Add({1, {0, 0.008F, 0.02F}, {0, 0.125F, -0.25F}}, impacts);
  impacts.mutable_hertz()->set_striker("wood");
  return step;
}

/// What an engine reports in a step: the low bar rests, and the high one slides.
carillon::v1::ContactStep Slide(int number) {
  carillon::v1::ContactStep step;
  step.set_time_s(number * kStepS);
  carillon::v1::ContactColumns& contacts = *step.add_contact_columns();
  contacts.set_kind(carillon::v1::CONTACT_KIND_REPORTED);
  Add({1, {0.125F, 0.016F, 0}, {0, 0, 0.0625F}}, contacts);
  Add({2, {0.0625F, 0, 0.01F}, {0, static_cast<float>(number) / 256, -0.03125F}}, contacts);
  for (const uint32_t partner : {0U, 9U}) contacts.add_partner(partner);
  for (const float speed : {0.0F, 0.5F}) contacts.add_travel_speed_m_per_s(speed);
  contacts.set_roughness_depth(0.25);
  contacts.set_irregularity_length_m(0.001);
  return step;
}

carillon::v1::ContactStep Pause() {
  carillon::v1::ContactStep step;
  step.set_time_s(0.25);
  step.set_time_scale(0);
  return step;
}

carillon::v1::ContactStep Collision() {
  carillon::v1::ContactStep step;
  step.set_time_s(0.5);
  step.set_time_scale(0.5);
  carillon::v1::ContactColumns& columns = *step.add_contact_columns();
  columns.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
  Add({1, {0.25F, 0, 0.01F}, {0, 0.5F, 0}}, columns);
  columns.add_duration_s(0.0009765625F);
  columns.add_time_offset_s(0.0078125F);
  columns.add_second_object(2);
  for (int i = 0; i < 3; ++i) columns.add_second_point_m(0);
  return step;
}

absl::Status WriteTrace(const std::string& model, const std::string& file) {
  absl::StatusOr<ContactTraceWriter> trace = ContactTraceWriter::Create(file, MakeHeader());
  if (!trace.ok()) return trace.status();
  WriteBars(model, *trace);
  absl::Status written = trace->Write(Knock());
  for (int number = 1; number <= 16; ++number) written.Update(trace->Write(Slide(number)));
  written.Update(trace->Write(Pause()));
  written.Update(trace->Write(Collision()));
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
