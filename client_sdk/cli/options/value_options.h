// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client_sdk/cli/commands/program.h"

namespace CLI {  // NOLINT(readability-identifier-naming): as the library has it
class App;
class Option;
}  // namespace CLI

namespace carillon::cli {

/// The description of an argument that names a model.
inline constexpr char kModelName[] =
    "The name, the label, or the first digits of the digest of a model";

/// The description of the values that ReadGain reads.
inline constexpr char kGainForm[] = "a factor such as 0.5, or decibels: --gain=-6dB";

/// Lets an option for a number read a factor or decibels; see ParseGain.
void ReadGain(CLI::Option& option);

/// Lets an option take numbers from `low` to `high` only. Unlike CLI::Range it refuses "nan". The
/// message about another number ends with `advice`.
void TakeWithin(CLI::Option& option, double low, double high, const std::string& advice = "");

/// Lets an option take the sizes that a sounding object may have.
void TakeSize(CLI::Option& option);

/// Lets an option take a time of zero or more.
void TakeSeconds(CLI::Option& option);

/// Returns a sentence that says which formats can be written if the suffix of `path` is not one of
/// `suffixes`, such as ".wav". Small and capital letters are equal. Returns an empty string if the
/// suffix is one of them, or if the path has no suffix.
std::string WhyNotWritten(const std::string& path, const std::vector<std::string>& suffixes);

/// Lets a command call `run` with the daemon and whether results are printed as JSON.
void SetRun(CLI::App& command, Program& program,
            std::function<absl::Status(const client::Client& daemon, bool json)> run);

/// Throws a CLI::ValidationError if JSON is asked for while stdout, "-" as `out`, has the sound.
void CheckJson(const Program& program, const std::string& out);

}  // namespace carillon::cli
