// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "client_sdk/fit/material_fit.h"

namespace carillon::cli {

/// The options of `carillon material extract`.
struct ExtractOptions {
  std::vector<std::string> recordings;
  std::string out;  ///< a CSV file; empty: none
};

/// The options of `carillon material fit`.
struct FitOptions {
  std::string model;
  std::vector<std::string> recordings;  ///< of the model's body; .csv: modes measured elsewhere
  std::string modes;                    ///< a CSV file in place of recordings
  std::vector<std::vector<std::string>> others;  ///< further bodies: a model and its recordings
  fit::FitSettings settings;
  std::string out;       ///< the material as text
  std::string residual;  ///< a WAV file
};

/// Lists the modes of recorded strikes. Errors: those of ReadRecording and CheckModes; Internal
/// (OUTPUT_NOT_WRITABLE).
absl::Status ExtractModesOf(const ExtractOptions& options, bool json);

/// Fits a material to recordings of bodies whose models the daemon has. Errors: those of
/// ExtractModesOf, FitMaterial and FindModel; FailedPrecondition (MODEL_LACKS_SLOPES).
absl::Status FitMaterialTo(const client::Client& daemon, const FitOptions& options, bool json);

}  // namespace carillon::cli
