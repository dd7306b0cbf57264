// SPDX-License-Identifier: Apache-2.0
#include "client_sdk/cli/clips/clip_record.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client_sdk/cli/clips/file_digest.h"
#include "client_sdk/cli/output/output.h"

namespace carillon::cli {
namespace {

// Its members keep the order in which they were added.
using Json = nlohmann::ordered_json;

/// Text that is not UTF-8 gets a replacement character for each wrong byte.
std::string LineOf(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

Json Array(const v1::Vec3& vector) { return {vector.x(), vector.y(), vector.z()}; }

/// Adds what the object sounds with.
void AddState(const ObjectState& state, Json& json) {
  if (!state.material) return;
  Json figures = Json::parse(MessageJson(*state.material));
  if (!state.material->preset().empty()) json["material"] = state.material->preset();
  figures.erase("preset");
  json["material_figures"] = std::move(figures);
  json["transfer"] = state.has_transfer;
}

Json ObjectJson(const v1::ContactTraceObject& object, const ObjectState& state,
                const ClipFile* stem) {
  Json json = {{"handle", object.handle()}, {"model", object.modal_model()}};
  if (!object.label().empty()) json["label"] = object.label();
  AddState(state, json);
  if (stem != nullptr) {
    json["file"] = stem->name;
    json["sha256"] = stem->digest;
  }
  return json;
}

Json BlowJson(const v1::Blow& blow) {
  Json json = {{"time_s", blow.time_s()}, {"object", blow.object()}};
  if (blow.has_other_object()) json["other_object"] = blow.other_object();
  if (blow.has_partner()) json["partner"] = blow.partner();
  json["point_m"] = Array(blow.point_m());
  json["impulse_newton_seconds"] = Array(blow.impulse_newton_seconds());
  json["duration_s"] = blow.duration_s();
  return json;
}

Json SoundJson(const ClipRecord& record) {
  const v1::RenderSummary& summary = record.summary;
  Json json = {{"frame_count", record.frame_count},
               {"seconds", static_cast<double>(record.frame_count) / record.sample_rate_hz},
               {"cut", record.is_cut},
               {"peak_pa", summary.peak_pa()},
               {"pa_per_sample", summary.full_scale_pa() / record.factor},
               {"limited_frame_count", summary.limited_frame_count()},
               {"rejected_count", summary.rejected_count()},
               {"load_count", summary.findings().load_count()}};
  if (summary.has_integrated_lufs()) json["integrated_lufs"] = summary.integrated_lufs();
  json["paper_coupling_object_count"] = summary.paper_coupling_object_count();
  json["warnings"] = Json::array();
  for (const v1::Warning& warning : summary.warnings()) {
    json["warnings"].push_back(Json::parse(MessageJson(warning)));
  }
  return json;
}

bool IsThere(const std::filesystem::path& folder, const Json& file) {
  const auto digest = FileDigest(folder / file.at("file").get<std::string>());
  return digest.ok() && *digest == file.at("sha256");
}

/// Whether each object still sounds with what the record says.
bool HasStates(const Json& objects, const std::vector<ObjectState>& states) {
  if (objects.size() != states.size()) return false;
  for (size_t i = 0; i < states.size(); ++i) {
    Json wanted = Json::object();
    AddState(states[i], wanted);
    const auto is_same = [&](const auto& member) {
      return objects[i].contains(member.key()) && objects[i][member.key()] == member.value();
    };
    for (const auto& member : wanted.items()) {
      if (!is_same(member)) return false;
    }
  }
  return true;
}

bool IsWhole(const std::filesystem::path& folder, const ClipRecord& wanted, const Json& json) {
  const Json& objects = json.at("objects");
  return json.at("trace_sha256") == wanted.trace_digest &&
         json.at("settings") == Json::parse(wanted.settings) && HasStates(objects, wanted.states) &&
         IsThere(folder, json) &&
         std::all_of(objects.begin(), objects.end(), [&](const Json& object) {
           return !object.contains("file") || IsThere(folder, object);
         });
}

}  // namespace

bool AreSame(const std::vector<ObjectState>& a, const std::vector<ObjectState>& b) {
  return std::ranges::equal(a, b, [](const ObjectState& one, const ObjectState& other) {
    Json first = Json::object(), second = Json::object();
    AddState(one, first);
    AddState(other, second);
    return first == second;
  });
}

std::string SettingsText(const RenderOptions& options, const std::string& daemon_version) {
  Json json = {{"sample_rate_hz", options.sample_rate_hz},
               {"channel_count", options.channel_count},
               {"bits", options.bits},
               {"tail_s", options.tail_s},
               {"gain", options.gain},
               {"normalize", options.normalize},
               {"stems", options.stems},
               {"carillon", daemon_version}};
  if (options.full_scale_pa) json["full_scale_pa"] = *options.full_scale_pa;
  if (options.length_s) json["length_s"] = *options.length_s;
  if (options.length_s) json["fade_s"] = options.fade_s;
  return json.dump();
}

std::string RecordLine(const ClipRecord& record) {
  Json json = {{"clip", record.clip},
               {"file", record.sound.name},
               {"sha256", record.sound.digest},
               {"trace_sha256", record.trace_digest},
               {"settings", Json::parse(record.settings)}};
  if (!record.labels.empty()) json["labels"] = record.labels;
  json.update(SoundJson(record));
  json["objects"] = Json::array();
  for (size_t i = 0; i < record.objects.size(); ++i) {
    const ClipFile* const stem = i < record.stems.size() ? &record.stems[i] : nullptr;
    json["objects"].push_back(ObjectJson(record.objects[i], record.states[i], stem));
  }
  json["blows"] = Json::array();
  for (const v1::Blow& blow : record.blows) json["blows"].push_back(BlowJson(blow));
  return LineOf(json);
}

std::string ErrorLine(const std::string& clip, const absl::Status& error) {
  Json json = {{"clip", clip}};
  json.update(Json::parse(ErrorJson(error)));
  return LineOf(json);
}

ClipTotals TotalsOf(const std::filesystem::path& manifest) {
  ClipTotals totals;
  std::map<std::string, std::pair<uint64_t, std::string>> warnings;  // count, and an instance
  std::ifstream lines(manifest);
  for (std::string line; std::getline(lines, line);) {
    const Json record = Json::parse(line, nullptr, false);
    if (!record.is_object() || record.contains("error")) continue;
    const std::string clip = record.value("clip", "");
    const uint64_t frames = record.value("frame_count", uint64_t{0});
    const uint64_t limited = record.value("limited_frame_count", uint64_t{0});
    ++totals.clip_count;
    totals.frame_count += frames;
    totals.limited_frame_count += limited;
    if (record.value("paper_coupling_object_count", uint64_t{0}) > 0) ++totals.paper_clip_count;
    totals.peak_pa = std::max(totals.peak_pa, record.value("peak_pa", 0.0));
    if (limited > 0) {
      totals.limited_clips.push_back(
          {clip, static_cast<double>(limited) / static_cast<double>(frames)});
    }
    for (const Json& warning : record.value("warnings", Json::array())) {
      auto& [count, instance] = warnings[warning.at("id")];
      if (count++ == 0) instance = absl::StrCat(clip, ": ", warning.value("text", ""));
    }
  }
  if (totals.paper_clip_count > 0) {
    totals.warnings.push_back(absl::StrCat(
        Counted(totals.paper_clip_count, "clip"),
        " with objects sounding by the paper's coupling, whose levels are not physical, for lack "
        "of a transfer: once `carillon job list` shows none at work, the same command renders "
        "them again; `carillon transfer` makes one that was never begun"));
  }
  std::ranges::stable_sort(totals.limited_clips, std::ranges::greater(),
                           &ClipTotals::LimitedClip::share);
  for (const auto& [id, found] : warnings) {
    totals.warnings.push_back(
        absl::StrCat(id, " in ", Counted(found.first, "clip"), ", for instance in ", found.second));
  }
  return totals;
}

bool IsRendered(const std::filesystem::path& folder, const ClipRecord& wanted) {
  std::ifstream file(folder / absl::StrCat(wanted.clip, ".json"));
  try {
    const Json json = Json::parse(file);
    return !json.contains("error") && IsWhole(folder, wanted, json);
  } catch (const Json::exception&) {
    return false;  // no record, or not one of ours
  }
}

}  // namespace carillon::cli
