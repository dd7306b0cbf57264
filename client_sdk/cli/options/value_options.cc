// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/options/value_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client_sdk/cli/options/quantity.h"

namespace carillon::cli {

void ReadGain(CLI::Option& option) {
  option.type_name("GAIN")->transform([](const std::string& text) {
    const std::optional<double> gain = ParseGain(text);
    if (gain) return absl::StrFormat("%.17g", *gain);
    throw CLI::ValidationError(
        absl::StrCat(text,
                     " is no gain; give a factor of zero or more, such as 0.5, or decibels, "
                     "such as -6dB"));
  });
}

void TakeWithin(CLI::Option& option, double low, double high, const std::string& advice) {
  option.check([low, high, advice](const std::string& text) -> std::string {
    double value = 0;
    if (absl::SimpleAtod(text, &value) && value >= low && value <= high) return "";
    return absl::StrCat("\"", text, "\" must be a number from ", low, " to ", high,
                        advice.empty() ? "" : "; ", advice);
  });
}

void TakeSize(CLI::Option& option) { TakeWithin(option, 0.001, 1000); }

void TakeSeconds(CLI::Option& option) { TakeWithin(option, 0, 1e9); }

std::string WhyNotWritten(const std::string& path, const std::vector<std::string>& suffixes) {
  const std::string suffix =
      absl::AsciiStrToLower(std::filesystem::path(path).extension().string());
  if (suffix.empty() || std::ranges::find(suffixes, suffix) != suffixes.end()) return "";
  return absl::StrCat("\"", path, "\" must end with ", absl::StrJoin(suffixes, ", "),
                      ": no other format is written");
}

void SetRun(CLI::App& command, Program& program,
            std::function<absl::Status(const client::Client& daemon, bool json)> run) {
  command.callback([&program, run = std::move(run)] {
    program.command = [&program, run] { return run(*program.Daemon(), program.json); };
  });
}

void CheckJson(const Program& program, const std::string& out) {
  if (!program.json || out != "-") return;
  throw CLI::ValidationError("--json", "stdout has the sound; name a file with --out");
}

}  // namespace carillon::cli
