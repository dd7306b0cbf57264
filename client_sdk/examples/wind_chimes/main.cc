// SPDX-License-Identifier: Apache-2.0
//
// Makes wind chimes in a rigid-body simulation audible, and shows what a simulator has to do.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "carillon/client.h"
#include "client_sdk/examples/wind_chimes/tubes.h"
#include "client_sdk/examples/wind_chimes/wind_chimes.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/server_address.h"
#include "proto/cpp/status_macros.h"

namespace carillon::wind_chimes {
namespace {

constexpr char kMaterial[] = "chime_aluminum";
/// The chimes are those of the paper, and all of them sound alike from the first contact on.
constexpr v1::RadiationModel kRadiation = v1::RADIATION_MODEL_PAPER_COUPLING;

struct PlayOptions {
  std::string server = DefaultServerAddress();
  std::vector<std::string> models;
  double seconds = 20;
  uint64_t seed = 1;
  double gain = 1;
  std::string trace;
  bool offline = false;
  bool picture = false;
};

absl::Status WriteMeshes(const std::string& folder) {
  for (const Tube& tube : kTubes) {
    const auto path = std::filesystem::path(folder) / absl::StrCat(tube.note, ".obj");
    std::ofstream file(path);
    WriteTubeMesh(tube, file);
    file.close();
    if (!file) {
      return Refusal(absl::StatusCode::kInternal, "OUTPUT_NOT_WRITABLE",
                     absl::StrCat(path.string(), " cannot be written; choose another folder"));
    }
  }
  return absl::OkStatus();
}

/// The daemon's side of the simulation: a scene of six chimes, which the destructor deletes.
class LiveScene {
 public:
  static absl::StatusOr<std::unique_ptr<LiveScene>> Open(const PlayOptions& options) {
    std::unique_ptr<LiveScene> live(new LiveScene(options.server));
    RETURN_IF_ERROR(live->Fill(options));
    return live;
  }

  ~LiveScene() {
    stream_.reset();
    if (!scene_.empty()) (void)client_->DeleteScene(scene_);
  }

  absl::Status Send(const v1::ContactStep& step) { return stream_->Send(step); }
  absl::StatusOr<v1::StreamContactsResponse> Finish() { return stream_->Finish(); }

 private:
  explicit LiveScene(const std::string& server) : client_(client::Connect(server)) {}

  absl::Status Fill(const PlayOptions& options) {
    ASSIGN_OR_RETURN(const auto created, client_->CreateScene());
    scene_ = created.name();
    v1::AddObjectsRequest tubes;
    tubes.set_scene(scene_);
    for (size_t i = 0; i < options.models.size(); ++i) {
      v1::NewObject& tube = *tubes.add_objects();
      tube.set_modal_model(options.models[i]);
      tube.mutable_material()->set_preset(kMaterial);
      tube.set_gain(options.gain);
      tube.set_radiation(kRadiation);
      tube.set_handle(static_cast<uint32_t>(i + 1));
    }
    if (const auto added = client_->AddObjects(tubes); !added.ok()) return added.status();
    v1::ContactStreamStart start;
    start.set_scene(scene_);
    start.set_step_s(kStep_s);
    ASSIGN_OR_RETURN(stream_, client_->StreamContacts(start));
    return absl::OkStatus();
  }

  std::unique_ptr<client::Client> client_;
  std::string scene_;
  std::unique_ptr<client::ContactStream> stream_;
};

absl::StatusOr<client::ContactTraceWriter> BeginTrace(const PlayOptions& options) {
  v1::ContactTraceHeader header;
  header.set_simulator("carillon-wind-chimes");
  header.set_step_s(kStep_s);
  auto trace = client::ContactTraceWriter::Create(options.trace, header);
  if (!trace.ok()) return trace;
  for (size_t i = 0; i < options.models.size(); ++i) {
    v1::ContactTraceObject object;
    object.set_handle(static_cast<uint32_t>(i + 1));
    object.set_modal_model(options.models[i]);
    object.mutable_material()->set_preset(kMaterial);
    object.set_gain(options.gain);
    object.set_radiation(kRadiation);
    object.set_label(kTubes[i].note);
    trace->Write(object);
  }
  return trace;
}

void PrintReport(const v1::StreamContactsResponse& report) {
  absl::PrintF("the daemon played %d, %d late, %d lost, %d refused; delay %.1f ms\n",
               report.accepted_count(), report.late_count(), report.dropped_count(),
               report.rejected_count(),
               (report.scheduling_delay_s() + report.output_latency_s()) * 1e3);
  if (report.rejected_count() > 0) {
    absl::PrintF("refused: %s\n", report.last_rejection().message());
  }
}

absl::Status Play(const PlayOptions& options) {
  std::unique_ptr<LiveScene> live;
  if (!options.offline) {
    ASSIGN_OR_RETURN(live, LiveScene::Open(options));
  }
  std::optional<client::ContactTraceWriter> trace;
  if (!options.trace.empty()) {
    ASSIGN_OR_RETURN(trace, BeginTrace(options));
  }

  const Simulation chimes =
      Chimes(options.seed, options.picture ? Purpose::kPicture : Purpose::kSound);
  int contact_count = 0;
  const auto start = std::chrono::steady_clock::now();
  const int step_count = static_cast<int>(options.seconds / kStep_s);
  for (int i = 0; i < step_count; ++i) {
    const v1::ContactStep step = chimes();
    contact_count += step.contacts_size();
    if (trace) {
      RETURN_IF_ERROR(trace->Write(step));
    }
    if (!live) continue;
    // The simulation of a step takes less time than the step, so the loop waits for real time.
    std::this_thread::sleep_until(start + i * std::chrono::duration<double>(kStep_s));
    RETURN_IF_ERROR(live->Send(step));
  }
  absl::PrintF("%d contacts in %.1f s\n", contact_count, options.seconds);

  if (trace) {
    RETURN_IF_ERROR(trace->Close());
  }
  if (!live) return absl::OkStatus();
  const auto report = live->Finish();
  if (report.ok()) PrintReport(*report);
  return report.status();
}

int Report(const absl::Status& status) {
  if (status.ok()) return 0;
  const v1::ErrorInfo error = ToErrorInfo(status);
  absl::FPrintF(stderr, "carillon-wind-chimes: %s: %s\n", error.reason(), error.message());
  return 1;
}

int Main(int argc, char** argv) {
  CLI::App app("Plays wind chimes in a rigid-body simulation through Carillon.");
  app.require_subcommand(1);

  std::string folder;
  CLI::App& meshes = *app.add_subcommand(
      "meshes", "Write the meshes of the six tubes as OBJ files with the names of their notes");
  meshes.add_option("folder", folder, "The folder to write to")
      ->required()
      ->check(CLI::ExistingDirectory);

  PlayOptions options;
  CLI::App& play =
      *app.add_subcommand("play", "Simulate the chimes, and send each contact as it happens");
  play.add_option("models", options.models, "The modal models of the tubes, longest first")
      ->required()
      ->expected(static_cast<int>(kTubes.size()));
  play.add_option("--server", options.server, "The address of the daemon: unix:PATH or HOST:PORT")
      ->capture_default_str();
  play.add_option("--seconds", options.seconds, "The simulated time, s")->capture_default_str();
  play.add_option("--seed", options.seed, "The seed of the wind")->capture_default_str();
  play.add_option("--gain", options.gain, "The linear gain of every chime")->capture_default_str();
  play.add_option("--trace", options.trace, "Record the contacts to this contact trace");
  play.add_flag("--offline", options.offline,
                "Only record, as fast as possible and without a daemon");
  play.add_flag("--picture", options.picture,
                "Record the poses of all parts, too; the clapper is 7, the sail 8");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return Report(meshes.parsed() ? WriteMeshes(folder) : Play(options));
}

}  // namespace
}  // namespace carillon::wind_chimes

int main(int argc, char** argv) { return carillon::wind_chimes::Main(argc, argv); }
