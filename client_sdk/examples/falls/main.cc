// SPDX-License-Identifier: Apache-2.0
//
// Lets the bodies of a scene fall in Bullet, ODE or MuJoCo and records their contacts as the engine
// reports them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "carillon/contact_trace.h"
#include "client_sdk/examples/falls/fall.h"
#include "proto/cpp/status_macros.h"

namespace carillon::falls {
namespace {

struct Options {
  std::string scene, trace, engine = "bullet";
  double rate_hz = 240;
  std::optional<double> seconds;  ///< absent: as long as the scene says
};

bool HasHull(const Body& body) { return std::holds_alternative<Hull>(body.shape); }

absl::StatusOr<Simulation> Simulate(const Options& options, const FallScene& scene) {
  const double step_s = 1 / options.rate_hz;
  if (options.engine == "bullet") return FallInBullet(scene, step_s);
  if (options.engine == "ode") {
    if (std::ranges::any_of(scene.bodies, HasHull)) {
      return absl::InvalidArgumentError("ODE has no hulls of corners alone; take another engine");
    }
    return FallInOde(scene, step_s);
  }
#ifdef CARILLON_MUJOCO
  return FallInMujoco(scene, step_s);
#else
  return absl::UnimplementedError("built without MuJoCo; install libmujoco-dev and build again");
#endif
}

v1::ContactTraceObject ObjectOf(const Body& body, uint32_t handle) {
  v1::ContactTraceObject object;
  object.set_handle(handle);
  object.set_label(body.name);
  object.set_modal_model(body.model);
  object.mutable_material()->set_preset(body.material);
  const auto& [x, y, z] = body.position_m;
  v1::Pose& pose = *object.mutable_pose();
  pose.mutable_position_m()->set_x(x);
  pose.mutable_position_m()->set_y(y);
  pose.mutable_position_m()->set_z(z);
  pose.mutable_orientation()->set_w(body.orientation[0]);
  pose.mutable_orientation()->set_x(body.orientation[1]);
  pose.mutable_orientation()->set_y(body.orientation[2]);
  pose.mutable_orientation()->set_z(body.orientation[3]);
  return object;
}

absl::Status Record(const Options& options) {
  ASSIGN_OR_RETURN(auto scene, ReadFallScene(options.scene));
  ASSIGN_OR_RETURN(auto simulation, Simulate(options, scene));
  v1::ContactTraceHeader header;
  header.set_simulator(absl::StrCat("carillon-fall ", options.engine));
  header.set_step_s(1 / options.rate_hz);
  ASSIGN_OR_RETURN(auto trace, client::ContactTraceWriter::Create(options.trace, header));
  uint32_t handle = 0;
  for (const Body& body : scene.bodies) {
    ++handle;
    if (!body.model.empty()) trace.Write(ObjectOf(body, handle));
  }
  const int step_count =
      static_cast<int>(options.seconds.value_or(scene.seconds) * options.rate_hz);
  for (int i = 0; i < step_count; ++i) {
    RETURN_IF_ERROR(trace.Write(simulation()));
  }
  return trace.Close();
}

int Main(int argc, char** argv) {
  CLI::App app("Records a contact trace of bodies that fall in a physics engine.");
  Options options;
  app.add_option("scene", options.scene, "The scene, a JSON file (docs/decisions/0042)")
      ->required();
  app.add_option("trace", options.trace, "The contact trace to write")->required();
  app.add_option("--engine", options.engine, "The physics engine")
      ->check(CLI::IsMember({"bullet", "ode", "mujoco"}))
      ->capture_default_str();
  app.add_option("--rate", options.rate_hz, "The number of simulation steps in a second")
      ->check(CLI::Range(20.0, 10000.0))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "The simulated time, s [what the scene says]")
      ->check(CLI::Range(0.0, 1000.0));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const absl::Status status = Record(options);
  if (status.ok()) return 0;
  absl::FPrintF(stderr, "carillon-fall: %s\n", status.message());
  return 1;
}

}  // namespace
}  // namespace carillon::falls

int main(int argc, char** argv) { return carillon::falls::Main(argc, argv); }
