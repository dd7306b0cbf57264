// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "client_sdk/cli/commands.h"
#include "client_sdk/cli/find_model.h"
#include "client_sdk/cli/output.h"
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
  const v1::Material& material = object.material();
  double sigma = DecayRatePerS(material, object.lowest_frequency_hz());
  sigma = std::min(sigma, DecayRatePerS(material, object.highest_frequency_hz()));
  for (const v1::LossFactorPoint& point : material.loss_factor()) {
    const double hz = std::clamp(point.frequency_hz(), object.lowest_frequency_hz(),
                                 object.highest_frequency_hz());
    sigma = std::min(sigma, DecayRatePerS(material, hz));
  }
  return std::min(kLongestSound, std::log(1000) / sigma);
}

void Set(v1::Vec3& vector, const std::array<double, 3>& components) {
  vector.set_x(components[0]);
  vector.set_y(components[1]);
  vector.set_z(components[2]);
}

absl::StatusOr<v1::SoundingObject> AddObject(const client::Client& daemon, const std::string& scene,
                                             const StrikeOptions& options) {
  ASSIGN_OR_RETURN(const auto model, FindModel(daemon, options.model));
  ASSIGN_OR_RETURN(const auto material, ToMaterial(options.material));
  v1::AddObjectRequest request;
  request.set_scene(scene);
  request.set_modal_model(model);
  if (material.ByteSizeLong() > 0) *request.mutable_material() = material;
  request.set_size(options.size);
  request.set_gain(options.gain);
  if (options.paper_coupling) request.set_radiation(v1::RADIATION_MODEL_PAPER_COUPLING);
  return daemon.AddObject(request);
}

/// Sends the strike so that it sounds on arrival.
absl::Status SendImpulse(const client::Client& daemon, const std::string& scene, uint32_t handle,
                         const StrikeOptions& options) {
  v1::ContactStreamStart start;
  start.set_scene(scene);
  start.set_step_s(kStep);
  start.set_at_once(true);
  ASSIGN_OR_RETURN(const auto stream, daemon.StreamContacts(start));
  v1::ContactStep step;
  v1::Impulse& impulse = *step.add_impulses();
  impulse.set_object(handle);
  Set(*impulse.mutable_point_m(), options.point_m);
  Set(*impulse.mutable_impulse_newton_seconds(), options.impulse_newton_seconds);
  if (options.duration_s) impulse.set_duration_s(*options.duration_s);
  impulse.mutable_hertz()->set_striker(options.striker);
  RETURN_IF_ERROR(stream->Send(std::move(step)));
  ASSIGN_OR_RETURN(const auto report, stream->Finish());
  if (report.rejected_count() == 0) return absl::OkStatus();
  return FromErrorInfo(absl::StatusCode::kInvalidArgument, report.last_rejection());
}

absl::Status StrikeIn(const client::Client& daemon, const std::string& scene,
                      const StrikeOptions& options, const StopSignal& stop, bool json) {
  ASSIGN_OR_RETURN(const auto object, AddObject(daemon, scene, options));
  RETURN_IF_ERROR(SendImpulse(daemon, scene, object.handle(), options));
  if (json) {
    PrintJson(object);
  } else {
    const bool paper = object.radiation() == v1::RADIATION_MODEL_PAPER_COUPLING;
    absl::PrintF("%d modes sound, %.2f to %.2f Hz, by %s\n", object.sounding_mode_count(),
                 object.lowest_frequency_hz(), object.highest_frequency_hz(),
                 paper ? "the paper's coupling" : "their radiated power");
  }
  std::fflush(stdout);
  (void)stop.ArrivesWithin(options.seconds.value_or(SoundingSeconds(object)));
  return absl::OkStatus();
}

}  // namespace

absl::Status Strike(const client::Client& daemon, const StrikeOptions& options,
                    const StopSignal& stop, bool json) {
  ASSIGN_OR_RETURN(const auto scene, daemon.CreateScene({}));
  const absl::Status struck = StrikeIn(daemon, scene, options, stop, json);
  const absl::Status deleted = daemon.DeleteScene(scene);
  return struck.ok() ? deleted : struck;
}

}  // namespace carillon::cli
