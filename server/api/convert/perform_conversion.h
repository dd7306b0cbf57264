// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "carillon/v1/performance.pb.h"
#include "server/scene/head_store.h"
#include "server/scene/offline/environment.h"

namespace carillon {

/// Converts the settings of a performance, with the contract's defaults. Errors: InvalidArgument
/// (INVALID_SETTINGS: a microphone), and those of HeadStore::Get.
absl::StatusOr<EnvironmentSettings> ToEnvironmentSettings(const v1::PerformSettings& settings,
                                                          HeadStore& heads);

/// Appends an impact to columns.
void AddImpact(uint32_t environment, const BlowRecord& impact, v1::PerformedImpacts& impacts);

}  // namespace carillon
