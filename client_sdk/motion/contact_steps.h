// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "carillon/v1/contact.pb.h"
#include "client_sdk/motion/motion.h"

namespace carillon::motion {

/// What a trace says of the contacts beside their impulses and forces.
struct StepSettings {
  /// The handle of each body, zero for a silent one.
  std::vector<uint32_t> handles;
  /// What each body strikes like if it is silent: a name of the catalogue of strikers, or a
  /// material for one that never moves.
  std::vector<std::string> strikers;
  double roughness_depth = 0;  ///< of every load, as in Roughness
  double irregularity_length_m = 0.001;
};

/// Returns a step for each frame: blows as impacts, at their own times and in the frames of the
/// bodies at these times, loads as contact forces, and the poses of the bodies that sound.
std::vector<v1::ContactStep> ToSteps(const Motion& motion, const FoundContacts& found,
                                     const StepSettings& settings);

}  // namespace carillon::motion
