// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "carillon/v1/modal_model_service.pb.h"

namespace carillon {

/// Where one decomposition reads and writes, and how many threads it may use.
struct WorkerPlace {
  std::filesystem::path program;
  std::filesystem::path mesh_file;
  std::filesystem::path model_file;
  int thread_count = 1;
};

/// The ways there are to compute one request: as asked; meshing with more caution; with the surface
/// repaired, too.
constexpr uint32_t kWayCount = 3;

/// The command line of carillon-precompute for a resolved request, computed in way `way` (below
/// kWayCount); it reports to descriptor 3.
std::vector<std::string> WorkerCommand(const v1::CreateModalModelRequest& resolved, uint32_t way,
                                       const WorkerPlace& place);

}  // namespace carillon
