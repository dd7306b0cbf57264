// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "carillon/client.h"
#include "client_sdk/cli/commands/commands.h"

namespace carillon::cli {

/// A sound file, by its name in the folder of the clips.
struct ClipFile {
  std::string name;
  std::string digest;  ///< SHA-256, hexadecimal
};

/// What an object of a trace sounds with, beside what the trace says.
struct ObjectState {
  /// Its figures, with the name of their preset. Absent: the daemon cannot tell.
  std::optional<v1::Material> material;
  /// Whether a stored transfer fits it. Without one it sounds by the paper's coupling, unless the
  /// trace says how it radiates.
  bool has_transfer = false;
};

/// The content of the record of a clip: a line of JSON, which docs/clips.md describes.
struct ClipRecord {
  std::string clip;          ///< the name of the trace without its suffix
  std::string trace_digest;  ///< SHA-256, hexadecimal
  std::string settings;      ///< SettingsText
  ClipFile sound;
  double factor = 1;         ///< by which the samples were multiplied
  uint64_t frame_count = 0;  ///< of the file
  uint32_t sample_rate_hz = 0;
  bool is_cut = false;                        ///< whether the sound was longer than the file
  std::map<std::string, std::string> labels;  ///< of the trace's author
  std::vector<v1::ContactTraceObject> objects;
  std::vector<ObjectState> states;  ///< one for each object
  std::vector<ClipFile> stems;      ///< one for each object, or none
  v1::RenderSummary summary;
  std::vector<v1::Blow> blows;
};

/// Whether the objects sound with the same materials and with transfers alike.
bool AreSame(const std::vector<ObjectState>& a, const std::vector<ObjectState>& b);

/// Returns, as JSON, everything on which the samples of a clip depend in addition to its trace, the
/// models and the states of its objects.
std::string SettingsText(const RenderOptions& options, const std::string& daemon_version);

/// These two functions return the line of a clip that was rendered, and the line of a clip that
/// could not be rendered.
std::string RecordLine(const ClipRecord& record);
std::string ErrorLine(const std::string& clip, const absl::Status& error);

/// Returns whether the record `clip`.json in `folder` was made from this trace with these settings
/// and these states of its objects, and whether all its files are there with the digests that the
/// record states.
bool IsRendered(const std::filesystem::path& folder, const ClipRecord& wanted);

/// What the records of a folder say together.
struct ClipTotals {
  struct LimitedClip {
    std::string clip;
    double share = 0;  ///< of its frames in which the limiter reduced the gain
  };

  uint64_t clip_count = 0;  ///< without those that could not be rendered
  uint64_t frame_count = 0;
  uint64_t limited_frame_count = 0;
  double peak_pa = 0;                      ///< of the loudest clip
  uint64_t paper_clip_count = 0;           ///< clips with objects that lack a transfer
  std::vector<LimitedClip> limited_clips;  ///< the most altered one first
  /// "3 clips have CONTACTS_LATE, for instance NAME: TEXT", one for each warning that clips have.
  std::vector<std::string> warnings;
};

/// Adds up the records of a manifest.
ClipTotals TotalsOf(const std::filesystem::path& manifest);

}  // namespace carillon::cli
