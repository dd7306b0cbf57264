// SPDX-License-Identifier: Apache-2.0
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "carillon/contact_trace.h"
#include "client_sdk/cli/commands/commands.h"
#include "client_sdk/cli/commands/find_model.h"
#include "client_sdk/cli/commands/mode_sound.h"
#include "client_sdk/cli/output/output.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/material_catalogue.h"
#include "proto/cpp/status_macros.h"

namespace carillon::cli {
namespace {

constexpr double kLongestSound = 30;  // seconds
constexpr double kStep = 0.001;       // seconds; there is one step only

/// Returns the time until the mode that decays slowest has decayed by 60 dB, T60 = ln(1000)/sigma.
/// That mode is the lowest one or, with a loss factor, one near a point of its table or the
/// highest.
double SoundingSeconds(const v1::SoundingObject& object) {
  if (object.sounding_mode_count() == 0) return 1;  // a click
  const v1::Material& material = object.material();
  double sigma = HUGE_VAL;
  const auto take = [&](const v1::Material& one) {
    sigma = std::min({sigma, DecayRatePerS(one, object.lowest_frequency_hz()),
                      DecayRatePerS(one, object.highest_frequency_hz())});
    for (const v1::LossFactorPoint& point : one.loss_factor()) {
      const double hz = std::clamp(point.frequency_hz(), object.lowest_frequency_hz(),
                                   object.highest_frequency_hz());
      sigma = std::min(sigma, DecayRatePerS(one, hz));
    }
  };
  // A mode of a body of several materials decays no slower than it would in the least damped one.
  for (const v1::RegionMaterial& region : material.regions()) take(region.material());
  if (material.regions().empty()) take(material);
  return std::min(kLongestSound, std::log(1000) / sigma);
}

void Set(v1::Vec3& vector, const std::array<double, 3>& components) {
  vector.set_x(components[0]);
  vector.set_y(components[1]);
  vector.set_z(components[2]);
}

v1::RadiationModel RadiationOf(const StrikeOptions& options) {
  if (options.paper_coupling) return v1::RADIATION_MODEL_PAPER_COUPLING;
  return options.modes_only ? v1::RADIATION_MODEL_MODES_ONLY : v1::RADIATION_MODEL_UNSPECIFIED;
}

absl::StatusOr<v1::SoundingObject> AddObject(const client::Client& daemon, const std::string& scene,
                                             const StrikeOptions& options) {
  ASSIGN_OR_RETURN(const auto model, FindModel(daemon, options.model));
  ASSIGN_OR_RETURN(const auto material, ToMaterial(options.material));
  v1::AddObjectsRequest request;
  request.set_scene(scene);
  v1::NewObject& object = *request.add_objects();
  object.set_modal_model(model);
  if (material.ByteSizeLong() > 0) *object.mutable_material() = material;
  object.set_size(options.size);
  object.set_gain(options.gain);
  object.set_radiation(RadiationOf(options));
  ASSIGN_OR_RETURN(const auto added, daemon.AddObjects(request));
  return added.front();
}

v1::Contact ImpactOf(const StrikeOptions& options, uint32_t handle) {
  v1::Contact impact;
  impact.set_kind(v1::CONTACT_KIND_IMPACT);
  impact.set_object(handle);
  Set(*impact.mutable_point_m(), options.point_m);
  Set(*impact.mutable_impulse_newton_seconds(), options.impulse_newton_seconds);
  if (options.duration_s) impact.set_duration_s(*options.duration_s);
  impact.mutable_hertz()->set_striker(options.striker);
  return impact;
}

/// Sends the strike so that it sounds on arrival. Returns the warnings about it.
absl::StatusOr<std::vector<std::string>> SendImpact(const client::Client& daemon,
                                                    const std::string& scene, uint32_t handle,
                                                    const StrikeOptions& options) {
  v1::ContactStreamStart start;
  start.set_scene(scene);
  start.set_step_s(kStep);
  start.set_at_once(true);
  ASSIGN_OR_RETURN(const auto stream, daemon.StreamContacts(start));
  v1::ContactStep step;
  *step.add_contacts() = ImpactOf(options, handle);
  RETURN_IF_ERROR(stream->Send(std::move(step)));
  ASSIGN_OR_RETURN(const auto report, stream->Finish());
  if (report.rejected_count() > 0) {
    return FromErrorInfo(absl::StatusCode::kInvalidArgument, report.last_rejection());
  }
  std::vector<std::string> warnings;
  for (const v1::Warning& warning : report.warnings()) {
    warnings.push_back(absl::StrCat(warning.id(), ": ", warning.text()));
  }
  return warnings;
}

/// The strike as a rendering measures it.
struct MeasuredStrike {
  double peak_pa = 0;
  double duration_s = 0;             ///< of the contact
  uint64_t limited_frame_count = 0;  ///< as the limiter of an output at full volume counts them
};

/// A file in memory, which has a path as long as the object lives. Without memory for it, writing
/// to the path fails.
class TraceInMemory {
 public:
  TraceInMemory() : descriptor_(memfd_create("strike", MFD_CLOEXEC)) {}
  TraceInMemory(const TraceInMemory&) = delete;
  TraceInMemory& operator=(const TraceInMemory&) = delete;
  ~TraceInMemory() {
    if (descriptor_ >= 0) close(descriptor_);
  }

  std::string path() const { return absl::StrCat("/proc/self/fd/", descriptor_); }

 private:
  int descriptor_;
};

/// Writes the strike as a trace to `file`.
absl::Status WriteTrace(const v1::SoundingObject& object, const StrikeOptions& options,
                        const std::string& file) {
  v1::ContactTraceHeader header;
  header.set_step_s(kStep);
  ASSIGN_OR_RETURN(auto writer, client::ContactTraceWriter::Create(file, header));
  v1::ContactTraceObject body;
  body.set_handle(object.handle());
  body.set_modal_model(object.modal_model());
  *body.mutable_material() = object.material();
  body.set_size(object.size());
  body.set_gain(object.gain());
  body.set_radiation(object.radiation());
  writer.Write(body);
  v1::ContactStep step;
  *step.add_contacts() = ImpactOf(options, object.handle());
  RETURN_IF_ERROR(writer.Write(step));
  return writer.Close();
}

/// Renders the beginning of the sound, which has its peak, offline. Absent: the daemon
/// renders as much as it may already.
std::optional<MeasuredStrike> Measure(const client::Client& daemon,
                                      const v1::SoundingObject& object,
                                      const StrikeOptions& options) {
  constexpr double kBeginning = 0.25;  // seconds
  const TraceInMemory memory;
  if (!WriteTrace(object, options, memory.path()).ok()) return std::nullopt;
  auto trace = client::ContactTraceReader::Open(memory.path());
  if (!trace.ok()) return std::nullopt;
  v1::RenderSettings settings;
  settings.set_tail_s(kBeginning);
  settings.set_tell_blows(true);
  double duration_s = 0;
  const auto summary = daemon.Render(
      settings, *trace, [](const client::AudioBlock&) { return true; },
      [&](const v1::Blow& blow) { duration_s = blow.duration_s(); });
  if (!summary.ok()) return std::nullopt;
  return MeasuredStrike{.peak_pa = summary->peak_pa(),
                        .duration_s = duration_s,
                        .limited_frame_count = summary->limited_frame_count()};
}

/// Prints what sounds, and how.
void PrintStrike(const client::Client& daemon, const v1::SoundingObject& object,
                 const StrikeOptions& options) {
  const char* by = "the radiated power";
  if (object.radiation() == v1::RADIATION_MODEL_PAPER_COUPLING) by = "the paper's coupling";
  if (object.radiation() == v1::RADIATION_MODEL_MODES_ONLY)
    by = "the radiated power, without the click";
  absl::PrintF("%s: %.2f to %.2f Hz, sounding by %s\n",
               Counted(object.sounding_mode_count(), "mode"), object.lowest_frequency_hz(),
               object.highest_frequency_hz(), by);
  if (const auto measured = Measure(daemon, object, options)) {
    absl::PrintF("contact of %.3g ms, peak %.3g Pa at 1 m%s\n", 1000 * measured->duration_s,
                 measured->peak_pa,
                 measured->limited_frame_count > 0 ? ", which the limiter lowers" : "");
  }
}

/// Prints the object, how long it is heard, the warnings and, where the daemon could measure them,
/// the contact's duration, the peak, and the frames that the limiter lowers.
void PrintStrikeJson(const client::Client& daemon, const v1::SoundingObject& object,
                     const StrikeOptions& options, const std::vector<std::string>& warnings) {
  std::vector<JsonMember> members = {{"seconds", options.seconds.value_or(SoundingSeconds(object))},
                                     {"warnings", warnings}};
  if (const auto model = daemon.GetModalModel(object.modal_model()); model.ok()) {
    for (JsonMember& member :
         ModeMembers(ModesOf(*model, object.material(), object.size()),
                     object.lowest_frequency_hz(), object.highest_frequency_hz())) {
      members.push_back(std::move(member));
    }
  }
  if (const auto measured = Measure(daemon, object, options)) {
    members.push_back({"contact_duration_s", measured->duration_s});
    members.push_back({"peak_pa", measured->peak_pa});
    members.push_back({"limited_frame_count", measured->limited_frame_count});
  }
  absl::PrintF("%s\n", MessageJson(object, members));
}

absl::Status StrikeIn(const client::Client& daemon, const std::string& scene,
                      const StrikeOptions& options, const StopSignal& stop, bool json) {
  ASSIGN_OR_RETURN(const auto object, AddObject(daemon, scene, options));
  ASSIGN_OR_RETURN(const auto warnings, SendImpact(daemon, scene, object.handle(), options));
  for (const std::string& warning : warnings) absl::FPrintF(stderr, "warning: %s\n", warning);
  if (json) {
    PrintStrikeJson(daemon, object, options, warnings);
  } else {
    PrintStrike(daemon, object, options);
  }
  std::fflush(stdout);
  (void)stop.ArrivesWithin(options.seconds.value_or(SoundingSeconds(object)));
  return absl::OkStatus();
}

/// Renders the strike to a file, and plays nothing.
absl::Status StrikeToFile(const client::Client& daemon, const StrikeOptions& options, bool json) {
  v1::SoundingObject object;
  ASSIGN_OR_RETURN(const v1::ModalModelSummary model, FindSummary(daemon, options.model));
  object.set_modal_model(model.name());
  ASSIGN_OR_RETURN(*object.mutable_material(), ToMaterial(options.material));
  if (object.material().ByteSizeLong() == 0) *object.mutable_material() = model.material();
  ASSIGN_OR_RETURN(const v1::Material material, MatchedMaterial(model, object.material()));
  object.set_handle(1);
  object.set_size(options.size);
  object.set_gain(options.gain);
  object.set_radiation(RadiationOf(options));
  const TraceInMemory trace;
  RETURN_IF_ERROR(WriteTrace(object, options, trace.path()));
  RenderOptions rendering;
  rendering.trace = trace.path();
  rendering.out = options.out;
  rendering.normalize = options.normalize;
  rendering.length_s = options.seconds;
  std::vector<JsonMember> members = ModeMembers(ModesOf(model, material, options.size));
  members.push_back(MaterialMember(material, object.material()));
  return Render(daemon, rendering, json, std::move(members)).status();
}

}  // namespace

absl::Status Strike(const client::Client& daemon, const StrikeOptions& options,
                    const StopSignal& stop, bool json) {
  if (!options.out.empty()) return StrikeToFile(daemon, options, json);
  ASSIGN_OR_RETURN(const auto scene, daemon.CreateScene());
  const absl::Status struck = StrikeIn(daemon, scene.name(), options, stop, json);
  const absl::Status deleted = daemon.DeleteScene(scene.name());
  return struck.ok() ? deleted : struck;
}

}  // namespace carillon::cli
