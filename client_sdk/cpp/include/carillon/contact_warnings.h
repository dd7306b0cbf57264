// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "carillon/v1/contact_service.pb.h"

namespace carillon::client {

/// Returns what a user should know about the contacts of a stream that did not sound as the program
/// meant, and how to repair it, one sentence each: contacts that were late, lost or rejected, that
/// lie far from their objects, had no impulse or one that no blow has, partners that changed in
/// each step, a step that was stated too short, time that stood still, and a simulation that ran
/// ahead of its sound. Returns an empty list if none of these was found. `report` is what
/// ContactStream::Finish() or Report() returned, and `dropped_step_count` what
/// ContactStream::DroppedStepCount() returned.
std::vector<std::string> ContactWarnings(const v1::StreamContactsResponse& report,
                                         uint64_t dropped_step_count = 0);

}  // namespace carillon::client
