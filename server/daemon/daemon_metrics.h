// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "server/api/api_server.h"
#include "server/decomposition/decomposition_queue.h"
#include "server/live_output/live_output.h"
#include "server/metrics/metrics_server.h"
#include "server/mode_database/mode_database.h"
#include "server/scene/scene_registry.h"

namespace carillon {

/// The parts of the daemon that metrics are read from.
struct MeasuredRooms {
  std::string version;
  LiveOutput& output;
  SceneRegistry& scenes;
  DecompositionQueue& decompositions;
  ModeDatabase& database;
  ApiServer& server;
};

/// Returns the present values of the daemon's metrics, which docs/run.md lists.
std::vector<Metric> ReadMetrics(const MeasuredRooms& rooms);

}  // namespace carillon
