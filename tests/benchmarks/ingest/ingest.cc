// SPDX-License-Identifier: Apache-2.0
//
// Sends impulses to a scene as fast as the daemon takes them, and prints the counts.
// Usage: ingest SERVER SCENE FORM IMPULSES_A_MESSAGE SECONDS DELAY_S
// The scene's objects have the handles 1 to 16.
// The forms "rows" and "columns" strike each object at one point, and the form "spread" sends
// columns that strike a new point with each impulse.

#include <carillon/client.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>

#include "tests/benchmarks/stopwatch.h"

namespace {

constexpr uint32_t kObjectCount = 16;
constexpr std::array<float, 3> kPointM = {0, 0.008F, 0.01F};
constexpr std::array<float, 3> kImpulseNewtonSeconds = {0, 0, -1e-5F};
constexpr float kDurationS = 1e-3F;
// Steps that may wait before the sender rests; the client would refuse them at 4096.
constexpr size_t kMostWaiting = 256;

struct Options {
  bool columns = false;
  bool spread = false;
  uint32_t impulse_count = 1;
  double seconds = 1;
};

void AddColumns(const Options& options, carillon::v1::ContactColumns& columns) {
  columns.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
  std::array<float, 3> point_m = kPointM;
  for (uint32_t i = 0; i < options.impulse_count; ++i) {
    if (options.spread) {
      point_m[1] = kPointM[1] * static_cast<float>(i) / static_cast<float>(options.impulse_count);
    }
    columns.add_object(1 + i % kObjectCount);
    columns.mutable_point_m()->Add(point_m.begin(), point_m.end());
    columns.mutable_impulse_newton_seconds()->Add(kImpulseNewtonSeconds.begin(),
                                                  kImpulseNewtonSeconds.end());
    columns.add_duration_s(kDurationS);
  }
}

void AddRow(uint32_t i, carillon::v1::ContactStep& step) {
  carillon::v1::Contact& impulse = *step.add_contacts();
  impulse.set_kind(carillon::v1::CONTACT_KIND_IMPACT);
  impulse.set_object(1 + i % kObjectCount);
  impulse.mutable_point_m()->set_y(kPointM[1]);
  impulse.mutable_point_m()->set_z(kPointM[2]);
  impulse.mutable_impulse_newton_seconds()->set_z(kImpulseNewtonSeconds[2]);
  impulse.set_duration_s(kDurationS);
}

carillon::v1::ContactStep MakeStep(double time_s, const Options& options) {
  carillon::v1::ContactStep step;
  step.set_time_s(time_s);
  if (options.columns) AddColumns(options, *step.add_contact_columns());
  for (uint32_t i = 0; !options.columns && i < options.impulse_count; ++i) AddRow(i, step);
  return step;
}

void SendAll(const Options& options, carillon::client::ContactStream& stream) {
  const carillon::Stopwatch watch;
  while (watch.Seconds() < options.seconds) {
    while (stream.WaitingStepCount() >= kMostWaiting) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    if (!stream.Send(MakeStep(watch.Seconds(), options)).ok()) return;
  }
}

int Run(const std::string& server, const carillon::v1::ContactStreamStart& start,
        const Options& options) {
  const auto client = carillon::client::Connect(server);
  auto stream = client->StreamContacts(start);
  if (!stream.ok()) return 1;
  const carillon::Stopwatch watch;
  SendAll(options, **stream);
  const auto report = (*stream)->Finish();
  if (!report.ok()) return 1;
  std::cout << "{\"seconds\": " << watch.Seconds() << ", \"cpu_s\": " << watch.CpuSeconds()
            << ", \"accepted\": " << report->accepted_count()
            << ", \"late\": " << report->late_count()
            << ", \"dropped\": " << report->dropped_count()
            << ", \"rejected\": " << report->rejected_count()
            << ", \"steps\": " << report->step_count() << "}\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  carillon::v1::ContactStreamStart start;
  start.set_scene(argv[2]);
  start.set_step_s(1e-3);
  start.set_scheduling_delay_s(std::atof(argv[6]));
  Options options;
  options.spread = argv[3] == std::string("spread");
  options.columns = options.spread || argv[3] == std::string("columns");
  options.impulse_count = static_cast<uint32_t>(std::atoi(argv[4]));
  options.seconds = std::atof(argv[5]);
  return Run(argv[1], start, options);
}
