// SPDX-License-Identifier: Apache-2.0
//
// Performs environments for some seconds, and writes the samples of the first steps to a file.
// Prints a line when it begins to measure, and one with the number of steps and the time they took.
// Usage: performed SERVER MODEL ENVIRONMENTS BODIES STEP_S SECONDS FILE
// In each step every body of every environment has a pose, and one of them is struck.

#include <carillon/client.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <span>
#include <string>

namespace {

using carillon::client::Performance;
using carillon::client::PerformedStep;
using std::chrono::steady_clock;

/// Steps whose samples are written, before those whose time is measured.
constexpr uint64_t kStepsBefore = 20;

struct Case {
  uint32_t environment_count = 1;
  uint32_t body_count = 1;
  double step_s = 0.02;
};

double CpuS() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

carillon::v1::PerformSettings SettingsOf(const Case& own, const std::string& model) {
  carillon::v1::PerformSettings settings;
  settings.set_environment_count(own.environment_count);
  settings.set_step_s(own.step_s);
  auto& microphone = *settings.add_microphones();
  microphone.set_kind(carillon::v1::MICROPHONE_KIND_OMNI);
  microphone.mutable_pose()->mutable_position_m()->set_z(1.5);
  for (uint32_t handle = 1; handle <= own.body_count; ++handle) {
    auto& object = *settings.add_objects()->mutable_object();
    object.set_handle(handle);
    object.set_modal_model(model);
  }
  return settings;
}

void AddPoses(const Case& own, uint64_t number, carillon::v1::PerformedPoses& poses) {
  for (uint32_t environment = 0; environment < own.environment_count; ++environment) {
    for (uint32_t handle = 1; handle <= own.body_count; ++handle) {
      poses.add_environment(environment);
      poses.mutable_columns()->add_object(handle);
      for (const double coordinate : {0.1 * handle, 0.0, 1e-4 * static_cast<double>(number)}) {
        poses.mutable_columns()->add_position_m(coordinate);
      }
    }
  }
}

void AddBlows(const Case& own, uint64_t number, carillon::v1::PerformedContacts& blows) {
  blows.mutable_columns()->set_kind(carillon::v1::CONTACT_KIND_IMPACT);
  for (uint32_t environment = 0; environment < own.environment_count; ++environment) {
    blows.add_environment(environment);
    blows.mutable_columns()->add_object(
        1 + static_cast<uint32_t>((environment + number) % own.body_count));
    for (const float coordinate : {0.0F, 0.008F, 0.01F}) {
      blows.mutable_columns()->add_point_m(coordinate);
    }
    for (const float coordinate : {0.0F, 0.0F, -0.002F}) {
      blows.mutable_columns()->add_impulse_newton_seconds(coordinate);
    }
    blows.mutable_columns()->add_duration_s(1e-4F);
  }
}

/// Performs one step.
absl::StatusOr<PerformedStep> Perform(const Case& own, uint64_t number, Performance& performance) {
  carillon::v1::PerformStep step;
  AddPoses(own, number, *step.mutable_poses());
  AddBlows(own, number, *step.add_contacts());
  return performance.Step(step);
}

absl::Status WriteFirstSteps(const Case& own, const char* file, Performance& performance) {
  std::ofstream samples(file, std::ios::binary);
  for (uint64_t number = 0; number < kStepsBefore; ++number) {
    const auto performed = Perform(own, number, performance);
    if (!performed.ok()) return performed.status();
    const auto bytes = std::as_bytes(performed->samples);
    samples.write(reinterpret_cast<const char*>(bytes.data()),
                  static_cast<std::streamsize>(bytes.size()));
  }
  return absl::OkStatus();
}

absl::Status Measure(const Case& own, double seconds, Performance& performance) {
  float loudest = 0;
  uint64_t count = 0;
  std::cout << "begun\n" << std::flush;
  const double cpu_before_s = CpuS();
  const steady_clock::time_point begin = steady_clock::now();
  std::chrono::duration<double> passed{};
  for (; passed.count() < seconds; ++count) {
    const auto performed = Perform(own, kStepsBefore + count, performance);
    if (!performed.ok()) return performed.status();
    loudest = std::max(loudest, *std::ranges::max_element(performed->samples));
    passed = steady_clock::now() - begin;
  }
  std::cout << "{\"steps\": " << count << ", \"seconds\": " << passed.count()
            << ", \"cpu_s\": " << CpuS() - cpu_before_s << ", \"loudest\": " << loudest << "}\n";
  return absl::OkStatus();
}

}  // namespace

int main(int count, char** values) {
  if (count != 8) return 2;
  const Case own{.environment_count = static_cast<uint32_t>(std::atoi(values[3])),
                 .body_count = static_cast<uint32_t>(std::atoi(values[4])),
                 .step_s = std::atof(values[5])};
  const auto client = carillon::client::Connect(values[1]);
  const auto performance = client->Perform(SettingsOf(own, values[2]));
  absl::Status status = performance.status();
  if (status.ok()) status = WriteFirstSteps(own, values[7], **performance);
  if (status.ok()) status = Measure(own, std::atof(values[6]), **performance);
  if (!status.ok()) std::cerr << status << '\n';
  return status.ok() ? 0 : 1;
}
