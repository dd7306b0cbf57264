// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "client_sdk/cli/material_figures.h"
#include "client_sdk/cli/quantity.h"
#include "client_sdk/cli/stop_signal.h"

namespace carillon::cli {

/// What `carillon model create` asks for.
struct CreateModelOptions {
  std::string file;
  std::string format;  ///< empty: the file name's suffix
  MaterialFigures material;
  std::string label;  ///< empty: the file name without its suffix
  std::string unit = "m";
  std::string element = "quadratic";
  std::string mass = "consistent";
  double size = 1;
  double min_frequency_hz = 20;
  double max_frequency_hz = 20000;
  std::optional<bool> keep_surface;
  uint32_t target_node_count = 0;
  uint32_t keep_mode_count = 0;
  bool coarse_first = false;
  int32_t priority = 0;
  double time_limit_s = 0;
  uint64_t memory_limit_mib = 0;
  bool repair = false;
  double wall_m = 0;
  double accuracy = 0;
  Budget budget;
  std::vector<std::string> fixtures;  ///< as ParseFixture reads them
  bool wait = false;
};

/// What `carillon model export` writes, and where to.
struct ExportOptions {
  std::string model;
  std::string file;          ///< empty: the digest, with the format's suffix, here
  std::string format;        ///< empty: by the file's suffix
  MaterialFigures material;  ///< for a glTF, which holds what a body of one material sounds like
};

/// What `carillon model import` reads.
struct ImportOptions {
  std::string file;
  std::string format;  ///< empty: by the file's suffix
  std::string label;   ///< empty: the name that a glTF gives, or none
  std::string pick;    ///< of the models of a glTF: its name or number, or the name of a node
  MaterialFigures
      material;  ///< of which a glTF's model was computed, where it does not say so itself
};

/// What `carillon job run` runs.
struct RunJobOptions {
  std::string digest;
  std::string token;
  std::vector<std::string> command;
};

/// What `carillon strike` strikes, and how.
struct StrikeOptions {
  std::string model;
  MaterialFigures material;
  std::array<double, 3> point_m = {};
  std::array<double, 3> impulse_newton_seconds = {};
  double duration_s = 0;
  double size = 1;
  double gain = 1;
  std::optional<double> seconds;  ///< absent: until the longest mode is 60 dB down, 30 s at most
};

/// Where `carillon listen` puts what it hears.
struct ListenOptions {
  std::string out;                ///< empty: raw samples to stdout
  std::optional<double> seconds;  ///< absent: until the program is stopped
};

/// What `carillon render` renders.
struct RenderOptions {
  std::string trace;
  std::string out;
  uint32_t sample_rate_hz = 48000;
  uint32_t channel_count = 1;
  double tail_s = 0;
};

/// The commands. Each prints its result to stdout (as JSON where `json`) and returns its error.
absl::Status ShowStatus(const client::Client& daemon, const std::string& server, bool json);
absl::Status CreateModel(const client::Client& daemon, const CreateModelOptions& options,
                         bool json);
/// All that match `filter`, or, where it has a page size, that page and where to go on.
absl::Status ListModels(const client::Client& daemon, const v1::ListModalModelsRequest& filter,
                        bool json);
absl::Status UpdateModel(const client::Client& daemon, const std::string& text,
                         v1::UpdateModalModelRequest change, bool json);
absl::Status ExportModel(const client::Client& daemon, const ExportOptions& options);
absl::Status ImportModel(const client::Client& daemon, const ImportOptions& options, bool json);
absl::Status ShowDatabaseStats(const client::Client& daemon, bool json);
absl::Status CollectGarbage(const client::Client& daemon, uint64_t budget_mib, bool json);
/// `text` is a name, a label or the first digits of a digest. With the frequencies that `figures`
/// give, where there are any.
absl::Status ShowModel(const client::Client& daemon, const std::string& text,
                       const MaterialFigures& figures, bool json);
absl::Status DeleteModel(const client::Client& daemon, const std::string& text);
absl::Status WatchJob(const client::Client& daemon, const std::string& text, bool json);
/// Fetches the mesh of a job as the file "mesh" in a folder of its own, runs the command there,
/// tells its progress (WorkerEvent on descriptor 3), and brings the file "model" or the error. A
/// daemon that does not answer is asked again for ten minutes. Errors: those of JobRunService,
/// Internal (OUTPUT_NOT_WRITABLE: no folder), Cancelled (RUN_STOPPED).
absl::Status RunJob(const client::Client& daemon, const RunJobOptions& options,
                    const StopSignal& stop);
absl::Status Strike(const client::Client& daemon, const StrikeOptions& options,
                    const StopSignal& stop, bool json);
absl::Status Listen(const client::Client& daemon, const ListenOptions& options,
                    const StopSignal& stop);
absl::Status Render(const client::Client& daemon, const RenderOptions& options, bool json);

}  // namespace carillon::cli
