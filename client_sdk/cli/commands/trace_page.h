// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "carillon/v1/audio_service.pb.h"

namespace carillon::cli {

/// A trace and its rendering.
struct RenderedTrace {
  std::string trace;  ///< the contact trace's file
  std::string wave;   ///< the file of its sound, in WAV
  v1::RenderedBlows blows{};
  v1::RenderSummary summary{};
};

/// Writes a page of one file, which shows the bodies, their motion and blows, and plays the sound
/// in any browser, without a server. `carillon-console --trace-page` gives the page, into which
/// this puts the trace. Errors: those of ExportModalModel, NotFound (FILE_NOT_FOUND), Aborted
/// (PROGRAM_ENDED: the program is missing), Internal (OUTPUT_NOT_WRITABLE).
absl::Status WriteTracePage(const client::Client& daemon, const RenderedTrace& rendered,
                            const std::string& path);

}  // namespace carillon::cli
