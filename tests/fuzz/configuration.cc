// SPDX-License-Identifier: Apache-2.0
// Reads the input as the daemon's configuration file.
#include <array>
#include <cstdint>
#include <string>

#include "server/daemon/options.h"
#include "tests/fuzz/memory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const carillon::MemoryFile file(data, size);
  const std::string path = file.path();
  const std::array<const char*, 3> arguments = {"carillond", "--config", path.c_str()};
  const auto command = carillon::ReadCommandLine(arguments.size(), arguments.data(), "0");
  if (command.ok()) carillon::PrintConfiguration(command->options);
  return 0;
}
