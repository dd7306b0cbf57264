// SPDX-License-Identifier: Apache-2.0

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client_sdk/cli/clips/clips_command.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/options/options.h"
#include "client_sdk/cli/options/value_options.h"

namespace carillon::cli {

void AddSound(CLI::App& render, RenderOptions& options) {
  ReadGain(*render.add_option(
      "--gain", options.gain,
      absl::StrCat("The gain of every sample of the file, after the limiter: ", kGainForm)));
  render.add_option("--full-scale-pa", options.full_scale_pa,
                    "The pressure of a sample of full scale, Pa [200]");
  render.add_flag(
      "--normalize", options.normalize,
      "Scale the sound to a peak of 0.9 of full scale; a sound that is below -40 dBFS or that the "
      "limiter changed is rendered again, with a full scale a little above its peak. Then --gain "
      "applies");
  render
      .add_option("--bits", options.bits, "The size of a sample: 16, 24, or 32 for floating point")
      ->check(CLI::IsMember({16, 24, 32}))
      ->capture_default_str();
  render.add_option("--sample-rate", options.sample_rate_hz, "The sample rate, Hz")
      ->capture_default_str();
  render
      .add_option("--channels", options.channel_count,
                  "The number of channels: 1 for mono, 2 for stereo")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  TakeWithin(*render.add_option("--length", options.length_s,
                                "The length of each file, s: a longer sound is cut, and a shorter "
                                "one is followed by silence [that of the sound]"),
             0.001, 1e5, "leave it out for the length of the sound");
  TakeSeconds(*render
                   .add_option("--fade", options.fade_s,
                               "The time over which a sound that --length cuts fades out, s")
                   ->needs("--length")
                   ->capture_default_str());
  render.add_option(
      "--tail", options.tail_s,
      "The time to render after the last contact, s; 0 renders until the sound has died "
      "away [0]");
  render.add_flag("--wait", options.wait,
                  "First compute the radiation that the bodies lack, which takes from seconds to "
                  "minutes; otherwise their levels and decays are not final");
}

namespace {

/// Traces that a daemon renders at a time.
constexpr size_t kMostWorkers = 8;

std::optional<Shard> ParseShard(const std::string& text) {
  const size_t slash = text.find('/');
  uint32_t number = 0, count = 0;
  if (slash == std::string::npos || !absl::SimpleAtoi(text.substr(0, slash), &number) ||
      !absl::SimpleAtoi(text.substr(slash + 1), &count) || number < 1 || number > count) {
    return std::nullopt;
  }
  return Shard{.number = number, .count = count};
}

void AddFolder(CLI::App& render, RenderOptions& options) {
  options.worker_count = std::clamp<size_t>(std::thread::hardware_concurrency(), 1, kMostWorkers);
  render.add_flag("--stems", options.stems,
                  "Write the sound of each object alone, too (of a folder)");
  render
      .add_option("--workers", options.worker_count, "The clips to render at a time (of a folder)")
      ->check(CLI::Range(size_t{1}, kMostWorkers))
      ->capture_default_str();
  render
      .add_option_function<std::string>(
          "--shard", [&options](const std::string& text) { options.shard = *ParseShard(text); },
          "The part of the folder to render: I/N is every N-th trace from the I-th on, such as "
          "$SLURM_ARRAY_TASK_ID/10 [1/1]")
      ->check([](const std::string& text) {
        return ParseShard(text) ? "" : text + " is not I/N with I from 1 to N, such as 3/10";
      });
}

/// Whether the path is a folder, as far as this user can see.
bool IsFolder(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

std::string WhyNoFolder(const std::string& out) {
  std::error_code ignored;
  if (out != "-" && (!std::filesystem::exists(out, ignored) || IsFolder(out))) return "";
  return absl::StrCat("\"", out, "\" must be a folder, because a folder of traces is rendered");
}

/// Refuses options that the command would not follow for the trace, or the folder, that is named.
void CheckUse(const CLI::App& render, const RenderOptions& options) {
  const bool is_folder = IsFolder(options.trace);
  for (const char* option : {"--stems", "--workers", "--shard"}) {
    if (is_folder || render.count(option) == 0) continue;
    throw CLI::ValidationError(option,
                               absl::StrCat("is for a folder of traces, and \"", options.trace,
                                            "\" is none; name a folder, or leave the option out"));
  }
  std::error_code ignored;
  if (options.wait && !is_folder && std::filesystem::exists(options.trace, ignored) &&
      !std::filesystem::is_regular_file(options.trace, ignored)) {
    throw CLI::ValidationError("--wait", "needs a trace in a file, which is read twice");
  }
  if (!options.html.empty() && (options.out == "-" || options.trace == "-" || is_folder)) {
    throw CLI::ValidationError(
        "--html", "needs a trace in a file, and a file for --out: the page has both in it");
  }
  const std::string wrong =
      is_folder ? WhyNoFolder(options.out) : WhyNotWritten(options.out, {".wav", ".wave"});
  if (!wrong.empty()) throw CLI::ValidationError("--out", wrong);
}

}  // namespace

void AddRender(CLI::App& app, Program& program) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App& render = *app.add_subcommand(
      "render", "Render a contact trace to a WAV file, or a folder of traces to a folder");
  render
      .add_option("trace", options->trace, "The contact trace (.contacts), or a folder of traces")
      ->required();
  render
      .add_option("--out", options->out,
                  "The WAV file to write, or - for stdout; the folder for a folder")
      ->required();
  render.add_option(
      "--html", options->html,
      "Also write a page of one file, which shows the bodies, their motion and blows, "
      "and plays the sound in any browser");
  AddSound(render, *options);
  AddFolder(render, *options);
  render.callback([&program, &render, options] {
    CheckUse(render, *options);
    CheckJson(program, options->out);
    program.command = [&program, options] {
      const StopSignal stop;
      const auto daemon = program.Daemon();
      if (IsFolder(options->trace)) return RenderClips(*daemon, *options, stop, program.json);
      AwaitedJobs jobs(*daemon, stop);
      const absl::Status awaited =
          options->wait ? AwaitTransfers(jobs, {options->trace}) : absl::OkStatus();
      return awaited.ok() ? Render(*daemon, *options, program.json).status() : awaited;
    };
  });
}

}  // namespace carillon::cli
