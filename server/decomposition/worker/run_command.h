// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace carillon {

/// The result of a command: its output on both streams, and whether its exit status was zero.
struct CommandResult {
  bool success = false;
  std::string output;
};

/// Runs a program of the search path to its end, with `input` on its standard input. Kills the
/// program after half a minute.
CommandResult RunCommand(const std::vector<std::string>& command, const std::string& input = "");

}  // namespace carillon
