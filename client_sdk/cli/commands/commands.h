// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "client_sdk/cli/commands/awaited_jobs.h"
#include "client_sdk/cli/commands/example_bodies.h"
#include "client_sdk/cli/commands/material_figures.h"
#include "client_sdk/cli/commands/program.h"
#include "client_sdk/cli/commands/stop_signal.h"
#include "client_sdk/cli/output/message_json.h"
#include "client_sdk/cli/output/rendered_file.h"

namespace carillon::cli {

/// The options of `carillon model create`.
struct CreateModelOptions {
  std::vector<std::string> files;
  std::string format;  ///< empty: the file name's suffix
  MaterialFigures material;
  std::string label;  ///< empty: the file name without its suffix
  v1::DecompositionSettings settings;
  double size = 1;
  double min_frequency_hz = 20;
  double max_frequency_hz = 0;  ///< zero: open, see CreateModalModelRequest
  bool coarse_first = false;
  bool without_transfer = false;
  int32_t priority = 0;
  double time_limit_s = 0;
  uint64_t memory_limit_mib = 0;
  bool wait = false;  ///< end with the jobs, and show their progress
  /// Whether to ask again with repair, while waiting, if the surface is refused and may be
  /// repaired.
  bool may_repair = true;
  std::string report;  ///< file that gets a line of JSON for each mesh file; empty: none
};

/// The options of `carillon transfer`.
struct CreateTransferOptions {
  std::string model;
  MaterialFigures material;
  double size = 1;
  double accuracy_db = 0;
  double budget_s = 0;
  bool wait = false;
};

/// The options of `carillon model export`.
struct ExportOptions {
  std::string model;
  std::string file;          ///< empty: the digest with the suffix of the format
  std::string format;        ///< empty: by the file's suffix
  MaterialFigures material;  ///< for a glTF, which describes a body of one material; empty: that
                             ///< which the model was made with
};

/// The options of `carillon model import`.
struct ImportOptions {
  std::string file;
  std::string format;        ///< empty: by the file's suffix
  std::string label;         ///< empty: the name that a glTF gives, or none
  std::string pick;          ///< a model of a glTF: its name or number, or the name of a node
  MaterialFigures material;  ///< of objects that name none; overrides that which a glTF states
};

/// The options of `carillon model tune`.
struct TuneOptions {
  std::string model;
  MaterialFigures material;  ///< empty: that which the model was made with
  uint32_t mode = 1;         ///< counted from 1
  double to_hz = 0;
  std::string by = "size";  ///< or "length", "thickness", "x", "y", "z"
};

/// The options of `carillon strike`.
struct StrikeOptions {
  std::string model;
  MaterialFigures material;
  std::array<double, 3> point_m = {};
  std::array<double, 3> impulse_newton_seconds = {};
  std::optional<double> duration_s;  ///< absent: as long as an elastic collision
  std::string striker;               ///< empty: steel
  double size = 1;
  double gain = 1;
  bool paper_coupling = false;
  bool modes_only = false;
  std::optional<double> seconds;  ///< absent: until the longest mode is 60 dB down, 30 s at most
  std::string out;                ///< WAV file to write instead of sounding; empty: none
  bool normalize = false;         ///< as in RenderOptions
};

/// The options of `carillon volume`.
struct VolumeOptions {
  std::string scene;  ///< empty: the output
  std::optional<double> gain;
  std::optional<bool> muted;
  std::optional<bool> solo;
};

/// The options of `carillon listen`.
struct ListenOptions {
  std::string out;                ///< empty: raw samples to stdout
  std::string scene;              ///< empty: the output
  bool quiet = false;             ///< no meter on a terminal
  std::optional<double> seconds;  ///< absent: until the program is stopped
};

/// The part of the clips of a folder that one run renders: every `count`-th.
struct Shard {
  size_t number = 1;  ///< 1 to `count`
  size_t count = 1;
};

/// The options of `carillon render`.
struct RenderOptions {
  std::string trace;  ///< a contact trace, or a folder of them
  std::string out;    ///< "-": stdout
  uint32_t sample_rate_hz = 48000;
  uint32_t channel_count = 1;
  double tail_s = 0;
  double gain = 1;                      ///< factor of every sample
  std::optional<double> full_scale_pa;  ///< pressure of a sample of 1; absent: the daemon's default
  bool normalize = false;  ///< scale the sound to a peak of 0.9 of full scale, before `gain`; a
                           ///< soft sound is first rendered again with a finer full scale
  std::string html;        ///< a page to write, too; empty for none
  int bits = 24;           ///< of a sample: 16, 24, or 32 for floating point
  std::optional<double> length_s;  ///< of the file: a longer sound is cut, and a shorter one is
                                   ///< followed by silence; absent: that of the sound
  double fade_s = 0.01;            ///< over which a sound that is cut fades out
  bool wait = false;               ///< until the radiation of the bodies is computed
  // These apply to a folder only.
  bool stems = false;       ///< write the sound of each object alone, too
  size_t worker_count = 1;  ///< clips at a time
  Shard shard{};
};

/// The commands. Each prints its result to stdout, as JSON if `json` is true, and returns its
/// error.
/// Shows the audio device, the mixer and the load of the daemon, and its features and limits. As
/// JSON these are the members of GetMixerResponse and, in "server", those of GetServerInfoResponse.
absl::Status ShowStatus(const client::Client& daemon, const std::string& server, bool json);
/// Creates the models of files. A file that gives no model does not stop the others. Errors: that
/// of the file if there is one file; otherwise FailedPrecondition (SOME_FAILED), Internal
/// (OUTPUT_NOT_WRITABLE: the report), Unavailable (SERVER_UNAVAILABLE), which stops all.
absl::Status CreateModel(const client::Client& daemon, const CreateModelOptions& options,
                         bool json);
absl::Status CreateTransfer(const client::Client& daemon, const CreateTransferOptions& options,
                            bool json);
/// Lists all models that match `filter`. If `filter` has a page size, lists that page only and
/// prints the token of the next one.
absl::Status ListModels(const client::Client& daemon, const v1::ListModalModelsRequest& filter,
                        bool json);
absl::Status UpdateModel(const client::Client& daemon, const std::string& text,
                         v1::UpdateModalModelRequest change, bool json);
absl::Status ExportModel(const client::Client& daemon, const ExportOptions& options, bool json);
absl::Status ImportModel(const client::Client& daemon, const ImportOptions& options, bool json);
/// Finds the size, or the length of one axis, at which a mode of a model has a pitch. Without a
/// change of size, stores the model of the stretched body, labelled "LABEL_tuned". Errors: those of
/// FindModel and of CreateModalModel, InvalidArgument (INVALID_SETTINGS), FailedPrecondition
/// (PITCH_NOT_REACHED).
absl::Status TuneModel(const client::Client& daemon, const TuneOptions& options, bool json);
absl::Status ShowDatabaseStats(const client::Client& daemon, bool json);
/// Writes a copy of the database to a file. Unless `json` is true, prints nothing.
absl::Status BackUpDatabase(const client::Client& daemon, const std::string& file, bool json);
absl::Status CollectGarbage(const client::Client& daemon, const v1::CollectGarbageRequest& request,
                            bool json);
/// Shows the model that `text` means: a name, a label or the first digits of a digest. If `figures`
/// name a material, shows the frequencies and decay rates of the modes too.
absl::Status ShowModel(const client::Client& daemon, const std::string& text,
                       const MaterialFigures& figures, bool json);
/// Deletes models. If one model cannot be deleted, the others are deleted all the same. Prints each
/// outcome if there are several models.
absl::Status DeleteModels(const client::Client& daemon, const std::vector<std::string>& texts,
                          bool json);
absl::Status ListJobs(const client::Client& daemon, const v1::ListJobsRequest& filter, bool json);
absl::Status ShowJob(const client::Client& daemon, const std::string& text, bool json);
absl::Status CancelJobs(const client::Client& daemon, const std::vector<std::string>& texts,
                        bool json);
/// Explains an error reason or a warning, or lists all if `name` is empty. Errors: InvalidArgument
/// (INVALID_SETTINGS).
absl::Status Explain(const std::string& name, bool json);
absl::Status ListMaterials(const client::Client& daemon, bool json);
absl::Status ShowMaterial(const client::Client& daemon, const std::string& name, bool json);
/// The options of `carillon console`.
struct ConsoleOptions {
  uint16_t port = 8700;  ///< of 127.0.0.1; zero takes any
  bool browser = true;   ///< whether to open a browser where there is a desktop
};

/// Returns the path of a program of Carillon: beside this one, or else its name, for PATH.
std::string PathOfCompanion(const std::string& name);
/// Starts the daemon, if none listens at the program's Unix socket, and the console; prints the
/// console's address, and opens it in a browser. Returns after a stop. Errors: Aborted
/// (PROGRAM_ENDED).
absl::Status RunConsole(const Program& program, const ConsoleOptions& options,
                        const StopSignal& stop);
/// Lists the scenes and their objects.
absl::Status ListScenes(const client::Client& daemon, bool json);
/// Deletes a scene, which `text` names as "scenes/7" or "7".
absl::Status DeleteScene(const client::Client& daemon, const std::string& text, bool json);
/// Writes the OBJ file of an example, stretched to `size_m` if that is not empty (WrittenExample).
/// `path` may be empty for the name of the example. Errors: Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteExample(const Example& example, const std::vector<double>& size_m,
                          const std::string& path, bool json);
absl::Status WatchJob(const client::Client& daemon, const std::string& text, bool json);
/// Prints the jobs that wait or run, and then each job that matches when its state changes, or with
/// `json` at each change, as long as somebody reads.
absl::Status WatchJobs(const client::Client& daemon, const v1::WatchJobsRequest& filter, bool json);
absl::Status Strike(const client::Client& daemon, const StrikeOptions& options,
                    const StopSignal& stop, bool json);
absl::Status Listen(const client::Client& daemon, const ListenOptions& options,
                    const StopSignal& stop, bool json);
/// Renders a trace to a file. As JSON, `members` follow the summary. Returns the options by which
/// another trace of the same objects is rendered at the same scale, without `normalize`. The caller
/// sees to `wait` before (AwaitTransfers).
absl::StatusOr<RenderOptions> Render(const client::Client& daemon, const RenderOptions& options,
                                     bool json, std::vector<JsonMember> members = {});
/// Lets the daemon compute the transfers that the objects of traces lack, and shows the progress.
/// Passes over what a trace has wrong: its rendering says why. Errors: those of the jobs.
absl::Status AwaitTransfers(AwaitedJobs& jobs, const std::vector<std::string>& traces);
v1::RenderSettings SettingsOf(const RenderOptions& options);
/// Returns how the sound of a trace is written to the file `path`.
RenderedForm FormOf(const RenderOptions& options, const std::string& path);
/// The least full scale that the contract allows, Pa.
inline constexpr double kLeastFullScale_pa = 0.00002;
/// The limiter works from 3 dB below full scale on. This factor of a sound's peak is a full scale
/// at which it does not work.
inline constexpr double kLimiterHeadroom = 1.4126;
/// Returns the full scale, Pa, with which a sound should be rendered again before it is normalised.
/// Modes end at -140 dB of full scale, so that a soft sound would be cut, and the limiter changes a
/// loud one. Returns nothing if the rendering is neither soft nor limited, is
/// silent, or has the full scale that was asked for.
std::optional<double> BetterFullScale(const RenderOptions& options,
                                      const v1::RenderSummary& summary);
/// Errors: InvalidArgument (TRACE_EMPTY: the rendered trace has no contact, and its sound is
/// silent; or the reason of the last rejection, if all contacts were rejected).
absl::Status CheckHasContacts(const std::string& path, const v1::RenderSummary& summary);

/// Returns the name of a scene that `text` names as "scenes/7" or "7". Returns an empty string if
/// `text` is empty.
std::string SceneNamed(const std::string& text);
/// Changes the properties of the volume that the options have, and prints the volume.
absl::Status ChangeVolume(const client::Client& daemon, const VolumeOptions& options, bool json);
/// Silences a scene, or all scenes of the caller if `scene` is empty.
absl::Status StopSound(const client::Client& daemon, const std::string& scene, bool json);
/// Writes the next contact stream of a scene to the file `out`, until the stream ends.
absl::Status RecordContacts(const client::Client& daemon, const std::string& scene,
                            const std::string& out, const StopSignal& stop);

}  // namespace carillon::cli
