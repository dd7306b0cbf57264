// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "carillon/v1/audio_service.pb.h"

namespace carillon {

/// Writes an input of the fuzzer of requests for each method of the contract, and some that the
/// daemon accepts.
void WriteRequestSeeds(const std::filesystem::path& folder,
                       const std::vector<v1::RenderRequest>& rendering);

}  // namespace carillon
