// SPDX-License-Identifier: Apache-2.0
//
// The commands that change how loud the daemon and its scenes are, and that record contacts.
#include <cmath>
#include <optional>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

void PrintVolume(const std::string& name, double gain, bool muted, bool solo) {
  absl::PrintF("%s  gain %.4g (%s)%s%s\n", name, gain,
               gain > 0 ? absl::StrFormat("%+.1f dB", 20 * std::log10(gain)) : "silence",
               muted ? "  muted" : "", solo ? "  solo" : "");
}

}  // namespace

std::string SceneNamed(const std::string& text) {
  return text.empty() || absl::StartsWith(text, "scenes/") ? text : absl::StrCat("scenes/", text);
}

absl::Status ChangeVolume(const client::Client& daemon, const VolumeOptions& options, bool json) {
  if (options.scene.empty()) {
    v1::UpdateMixerRequest request;
    if (options.gain) request.set_gain(*options.gain);
    if (options.muted) request.set_muted(*options.muted);
    ASSIGN_OR_RETURN(const v1::UpdateMixerResponse volume, daemon.UpdateMixer(request));
    if (json) {
      PrintJson(volume);
    } else {
      PrintVolume("output", volume.gain(), volume.muted(), false);
    }
    return absl::OkStatus();
  }
  v1::UpdateSceneRequest request;
  request.set_name(SceneNamed(options.scene));
  if (options.gain) request.set_gain(*options.gain);
  if (options.muted) request.set_muted(*options.muted);
  if (options.solo) request.set_solo(*options.solo);
  ASSIGN_OR_RETURN(const v1::Scene scene, daemon.UpdateScene(request));
  if (json) {
    PrintJson(scene);
  } else {
    PrintVolume(scene.name(), scene.gain(), scene.muted(), scene.solo());
  }
  return absl::OkStatus();
}

absl::Status StopSound(const client::Client& daemon, const std::string& scene, bool json) {
  ASSIGN_OR_RETURN(const uint32_t count, daemon.StopAll(SceneNamed(scene)));
  v1::StopAllResponse stopped;
  stopped.set_scene_count(count);
  if (json) {
    PrintJson(stopped);
  } else {
    absl::PrintF("%s silenced\n", Counted(count, "scene"));
  }
  return absl::OkStatus();
}

absl::Status RecordContacts(const client::Client& daemon, const std::string& scene,
                            const std::string& out, const StopSignal& stop) {
  std::optional<client::ContactTraceWriter> writer;
  absl::Status written;
  uint64_t step_count = 0;
  const auto take = [&](const v1::ContactTraceRecord& record) {
    if (record.has_header()) {
      auto created = client::ContactTraceWriter::Create(out, record.header());
      written = created.status();
      if (created.ok()) writer.emplace(*std::move(created));
    } else if (record.has_object() && writer) {
      writer->Write(record.object());
    } else if (record.has_step() && writer) {
      written = writer->Write(record.step());
      ++step_count;
    }
    return written.ok() && !stop.ArrivesWithin(0);
  };
  RETURN_IF_ERROR(daemon.RecordContacts(
      SceneNamed(scene),
      [&] { absl::FPrintF(stderr, "%s: waiting for a contact stream\n", SceneNamed(scene)); },
      take));
  RETURN_IF_ERROR(written);
  if (writer) RETURN_IF_ERROR(writer->Close());
  absl::FPrintF(stderr, "%s: %s\n", out, Counted(step_count, "step"));
  return absl::OkStatus();
}

}  // namespace carillon::cli
