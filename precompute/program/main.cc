// SPDX-License-Identifier: AGPL-3.0-or-later
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "precompute/codec/modal_model_codec.h"
#include "precompute/codec/read_modal_model.h"
#include "precompute/codec/transfer_codec.h"
#include "precompute/mesh/read/read_mesh.h"
#include "precompute/pipeline/body_regions.h"
#include "precompute/pipeline/decompose.h"
#include "precompute/pipeline/radiate.h"
#include "precompute/pipeline/remedies.h"
#include "precompute/pipeline/worker_request.h"
#include "precompute/program/command_line.h"
#include "precompute/program/json_report.h"
#include "precompute/program/progress_bar.h"
#include "precompute/program/progress_reporter.h"
#include "precompute/program/sha256.h"
#include "precompute/program/worker_events.h"
#include "precompute/sparse/openblas.h"
#include "proto/cpp/decomposition_settings.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/mesh_file.h"
#include "proto/cpp/status_macros.h"

namespace carillon::precompute {
namespace {

constexpr std::chrono::milliseconds kProgressInterval(250);

struct Result {
  StoredModel stored;
  std::optional<Transfer> transfer;
};

absl::StatusOr<StoredModel> DecomposeAndWrite(const CommandLine& asked,
                                              ProgressReporter& reporter) {
  ASSIGN_OR_RETURN(std::string mesh, ReadMeshFile(asked.input, asked.request.mesh_format()));
  ModelOrigin origin{.mesh_digest = Sha256Hex(mesh), .settings = asked.request.settings()};
  origin.settings.set_metres_per_unit(MetresPerUnit(origin.settings));
  ASSIGN_OR_RETURN(ModalModel model, Decompose(std::move(mesh), asked.request, reporter));
  RETURN_IF_ERROR(WriteModalModel(asked.output, model, origin));
  return StoredModel{std::move(model), std::move(origin)};
}

/// Computes the modes, or reads them where the input is a stored model; then their radiation, where
/// it is wanted.
absl::StatusOr<Result> Compute(CommandLine& asked, ProgressReporter& reporter) {
  const bool stored = asked.request.radiate_stored_model();
  Result result;
  ASSIGN_OR_RETURN(result.stored,
                   stored ? ReadModalModel(asked.input) : DecomposeAndWrite(asked, reporter));
  if (stored)
    RETURN_IF_ERROR(TakeReference(result.stored.model, *asked.request.mutable_material()));
  if (asked.request.has_transfer()) {
    ASSIGN_OR_RETURN(result.transfer, Radiate(result.stored.model, asked.request, reporter));
    RETURN_IF_ERROR(WriteTransfer(asked.transfer_output, *result.transfer, result.stored));
  }
  reporter.OnProgress(v1::PHASE_WRITE, 1);
  return result;
}

void PrintRadiation(const Transfer& transfer, const std::string& output) {
  const auto computed = std::ranges::count_if(transfer.modes, &ModeRadiation::computed);
  const auto wanted = std::ranges::count_if(transfer.modes, &ModeRadiation::in_band);
  std::printf("radiation of %td of %td modes in %.1f s of processor time, written to %s\n",
              computed, wanted, transfer.cpu_s, output.c_str());
}

void PrintModes(const ModalModel& model, const CommandLine& asked) {
  const IntendedUse use = UseOf(asked.request);
  std::printf(
      "%zu modes from %.2f to %.2f Hz, %d nodes, estimated to be off by at most %.2g %%, "
      "written to %s\n",
      model.eigenvalues.size(), use.FrequencyHz(model.eigenvalues.front()),
      use.FrequencyHz(model.eigenvalues.back()), model.node_count, 100 * model.WorstError(),
      asked.output.c_str());
  for (const std::string& warning : model.warnings) {
    std::fprintf(stderr, "warning: %s\n", warning.c_str());
  }
}

void PrintSummary(const Result& result, const CommandLine& asked) {
  if (!asked.request.radiate_stored_model()) PrintModes(result.stored.model, asked);
  if (result.transfer) PrintRadiation(*result.transfer, asked.transfer_output);
}

int Refuse(const absl::Status& status, bool json, const WorkerEvents& events) {
  const v1::ErrorInfo error = ToErrorInfo(status);
  std::fprintf(stderr, "carillon-precompute: %s: %s\n", error.reason().c_str(),
               error.message().c_str());
  for (const v1::Remedy& remedy : error.remedies()) {
    std::fprintf(stderr, "carillon-precompute: try %s\n", RemedyText(remedy).c_str());
  }
  if (json) std::puts(JsonError(status).c_str());
  events.SendError(status);
  return EXIT_FAILURE;
}

/// Flushes standard output. Returns the exit status of the program.
int FinishOutput() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return EXIT_SUCCESS;
  std::fprintf(stderr,
               "carillon-precompute: OUTPUT_NOT_WRITABLE: standard output cannot be written: %s; "
               "files that were asked for are complete\n",
               std::strerror(errno));
  return EXIT_FAILURE;
}

int Run(CommandLine asked) {
  SetThreadCount(asked.thread_count);
  const WorkerEvents events(asked.event_descriptor);
  absl::StatusOr<Result> result = absl::UnknownError("not computed");
  {
    const ProgressBar bar;
    ProgressReporter reporter(
        [&](const v1::Progress& progress) {
          events.SendProgress(progress);
          bar.Draw(progress);
        },
        kProgressInterval);
    result = Compute(asked, reporter);
    reporter.Stop();
    if (result.ok() && asked.json) {
      const Transfer* transfer = result->transfer ? &*result->transfer : nullptr;
      std::puts(JsonReport(result->stored.model, transfer, UseOf(asked.request), reporter).c_str());
    }
  }
  if (!result.ok()) {
    return Refuse(WithRemedies(result.status(), asked.request), asked.json, events);
  }
  if (!asked.json) PrintSummary(*result, asked);
  return FinishOutput();
}

/// Starts over with the environment that makes OpenBLAS fast; goes on as it is where that fails.
void RestartWithFastBlas(char** argv) {
  const char* core = BetterOpenBlasCore();
  if (core == nullptr || setenv("OPENBLAS_CORETYPE", core, 0) != 0) return;
  execv("/proc/self/exe", argv);
}

int Main(int argc, char** argv) {
  RestartWithFastBlas(argv);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGCHLD, SIG_DFL);  // the ends of meshing processes are lost while it is ignored
  absl::StatusOr<CommandLine> asked = ParseCommandLine(argc, argv);
  if (!asked.ok()) {
    // The options could not be read, so --json is looked for by itself.
    const bool json =
        std::any_of(argv, argv + argc, [](std::string_view a) { return a == "--json"; });
    return Refuse(asked.status(), json, WorkerEvents(-1));
  }
  if (asked->message) {
    std::fputs(asked->message->c_str(), stdout);
    return FinishOutput();
  }
  return Run(*std::move(asked));
}

}  // namespace
}  // namespace carillon::precompute

int main(int argc, char** argv) { return carillon::precompute::Main(argc, argv); }
