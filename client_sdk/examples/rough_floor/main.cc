// SPDX-License-Identifier: Apache-2.0
//
// Records a contact trace of a body that rests, slides or rolls on a rough floor in Bullet or in
// ODE. It shows how a simulator sends its contacts as the engine reports them, blows and loads
// alike.
#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "absl/strings/str_format.h"
#include "carillon/contact_trace.h"
#include "client_sdk/examples/rough_floor/rough_floor.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"

namespace carillon::rough_floor {
namespace {

struct Options {
  std::string engine = "bullet", trace, model, material = "oak";
  Scene scene = Scene::kRest;
  double rate_hz = 240, seconds = 5;
};

absl::Status Record(const Options& options) {
  const double step_s = 1 / options.rate_hz;
  v1::ContactTraceHeader header;
  header.set_simulator("carillon-rough-floor");
  header.set_step_s(step_s);
  ASSIGN_OR_RETURN(auto trace, client::ContactTraceWriter::Create(options.trace, header));
  v1::ContactTraceObject object;
  object.set_handle(1);
  object.set_modal_model(options.model);
  object.mutable_material()->set_preset(options.material);
  trace.Write(object);
  const Simulation simulation = options.engine == "ode"
                                    ? SimulateInOde(options.scene, {}, step_s)
                                    : SimulateInBullet(options.scene, {}, step_s);
  const int step_count = static_cast<int>(options.seconds * options.rate_hz);
  for (int i = 0; i < step_count; ++i) {
    RETURN_IF_ERROR(trace.Write(simulation()));
  }
  return trace.Close();
}

int Main(int argc, char** argv) {
  CLI::App app("Records a contact trace of a box or a bowl on a rough floor.");
  Options options;
  const std::map<std::string, Scene> scenes = {
      {"rest", Scene::kRest}, {"drag", Scene::kDrag}, {"roll", Scene::kRoll}};
  app.add_option("trace", options.trace, "The contact trace to write")->required();
  app.add_option("--model", options.model, "The modal model of the box or the bowl")->required();
  app.add_option("--material", options.material, "The material of the body")->capture_default_str();
  app.add_option("--engine", options.engine, "The physics engine")
      ->check(CLI::IsMember({"bullet", "ode"}))
      ->capture_default_str();
  app.add_option("--scene", options.scene, "The motion: rest, drag or roll")
      ->transform(CLI::CheckedTransformer(scenes));
  app.add_option("--rate", options.rate_hz, "The number of simulation steps in a second")
      ->check(CLI::Range(20.0, 10000.0))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "The simulated time, s")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const absl::Status status = Record(options);
  if (status.ok()) return 0;
  const v1::ErrorInfo error = ToErrorInfo(status);
  absl::FPrintF(stderr, "carillon-rough-floor: %s: %s\n", error.reason(), error.message());
  return 1;
}

}  // namespace
}  // namespace carillon::rough_floor

int main(int argc, char** argv) { return carillon::rough_floor::Main(argc, argv); }
