// SPDX-License-Identifier: Apache-2.0
//
// Performs environments for some seconds, and prints the number of steps and the time they took.
// Usage: lockstep SERVER MODEL ENVIRONMENTS BODIES STEP_S SECONDS
// In each step every body of every environment has a pose, and one of them is struck.

#include <carillon/client.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

namespace {

using carillon::client::Performance;
using std::chrono::steady_clock;

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

/// Performs one step, and returns the largest sample.
absl::StatusOr<float> Perform(const Case& own, uint64_t number, Performance& performance) {
  carillon::v1::PerformStep step;
  AddPoses(own, number, *step.mutable_poses());
  AddBlows(own, number, *step.add_contacts());
  const auto heard = performance.Step(step);
  if (!heard.ok()) return heard.status();
  return *std::ranges::max_element(heard->samples);
}

absl::Status Run(const Case& own, double seconds, Performance& performance) {
  float loudest = 0;
  uint64_t count = 0;
  double cpu_before_s = 0;
  steady_clock::time_point begin;
  std::chrono::duration<double> passed{};
  for (; passed.count() < seconds; ++count) {
    if (count == kStepsBefore) {
      begin = steady_clock::now();
      cpu_before_s = CpuS();
    }
    const absl::StatusOr<float> peak = Perform(own, count, performance);
    if (!peak.ok()) return peak.status();
    loudest = std::max(loudest, *peak);
    if (count >= kStepsBefore) passed = steady_clock::now() - begin;
  }
  std::cout << "{\"steps\": " << count - kStepsBefore << ", \"seconds\": " << passed.count()
            << ", \"cpu_s\": " << CpuS() - cpu_before_s << ", \"loudest\": " << loudest << "}\n";
  return absl::OkStatus();
}

}  // namespace

int main(int count, char** values) {
  if (count != 7) return 2;
  const Case own{.environment_count = static_cast<uint32_t>(std::atoi(values[3])),
                 .body_count = static_cast<uint32_t>(std::atoi(values[4])),
                 .step_s = std::atof(values[5])};
  const auto client = carillon::client::Connect(values[1]);
  const auto performance = client->Perform(SettingsOf(own, values[2]));
  const absl::Status status =
      performance.ok() ? Run(own, std::atof(values[6]), **performance) : performance.status();
  if (!status.ok()) std::cerr << status << '\n';
  return status.ok() ? 0 : 1;
}
