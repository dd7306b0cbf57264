// SPDX-License-Identifier: Apache-2.0
#include "carillon/contact_warnings.h"

#include <algorithm>
#include <cstdint>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace carillon::client {
namespace {

/// Time by which a simulation in real time may run ahead.
constexpr double kUsualLeadS = 0.25;

std::string Were(uint64_t count) {
  return absl::StrCat(count, count == 1 ? " contact was" : " contacts were");
}

void AddStepFindings(const v1::ContactFindings& findings, std::vector<std::string>& warnings) {
  if (findings.regular_gap_s() > 0) {
    warnings.push_back(absl::StrFormat(
        "most steps came %.3g s apart, which is longer than the step_s that was stated, so that a "
        "body at rest strikes in each of them; state the step of the simulator and the times of "
        "steps in seconds",
        findings.regular_gap_s()));
  }
  if (const uint64_t count = findings.standing_step_count(); count > 0) {
    warnings.push_back(
        absl::StrCat(count,
                     " steps with contacts had the time of the step before; give each step the "
                     "simulation's time, in seconds"));
  }
  if (const uint64_t count = findings.changed_partner_count(); count > 0) {
    warnings.push_back(
        absl::StrCat("in ", count,
                     " steps an object in contact touched none of its partners of the step "
                     "before, so that a body at rest strikes in each of them; give a body the "
                     "same partner in each step, such as the engine's number of that body"));
  }
}

void AddFindings(const v1::ContactFindings& findings, uint64_t accepted_count,
                 std::vector<std::string>& warnings) {
  AddStepFindings(findings, warnings);
  if (const uint64_t count = findings.fast_impulse_count(); count > 0) {
    warnings.push_back(absl::StrFormat(
        "%d contact%s changed the speed of an object by up to %.3g m/s; give impulses in newton "
        "seconds, which are forces times the step, and no forces",
        count, count == 1 ? "" : "s", findings.largest_speed_change_m_per_s()));
  }
  // The daemon counts an engine's contact without an impulse as a load, and it counts a strike with
  // an impulse of zero as accepted, once or twice for one or two objects.
  const uint64_t zeros = findings.zero_impulse_count();
  if (zeros > 0 && findings.blow_count() == 0 && zeros >= findings.load_count() &&
      2 * zeros >= accepted_count) {
    warnings.push_back(absl::StrCat(
        "the impulse of ", zeros, zeros == 1 ? " contact" : " contacts",
        " was zero, and no other sounded; read impulses after the engine has solved its step, and "
        "give newton seconds"));
  }
  if (const uint64_t count = findings.distant_point_count(); count > 0) {
    warnings.push_back(absl::StrFormat(
        "%d contact%s up to %.3g m away from the surfaces of the objects, and sound%s at the "
        "nearest points; give points in metres, in the frame of the "
        "stream, and if that is the scene's frame, give also the pose of each object",
        count, count == 1 ? " lies" : "s lie", findings.largest_distance_m(),
        count == 1 ? "s" : ""));
  }
}

}  // namespace

std::vector<std::string> ContactWarnings(const v1::StreamContactsResponse& report,
                                         uint64_t dropped_step_count) {
  std::vector<std::string> warnings;
  if (report.late_count() > 0) {
    warnings.push_back(absl::StrFormat(
        "%s late, and sounded at once instead of at the right time: send each step when it "
        "happens, or open the stream with a longer scheduling_delay_s (it was %.3g s)",
        Were(report.late_count()), report.scheduling_delay_s()));
  }
  if (report.remap_count() > 0) {
    warnings.push_back(absl::StrCat(
        "simulation time was mapped anew ", report.remap_count(),
        report.remap_count() == 1 ? " time" : " times",
        ", because every step of a quarter of a second was late: the simulator paused, sets no "
        "time_s, or is slower than real time, for which Client::Render and a trace suit"));
  }
  if (report.dropped_count() > 0) {
    warnings.push_back(
        absl::StrCat(Were(report.dropped_count()), " lost, because too many waited for the mixer"));
  }
  if (dropped_step_count > 0) {
    warnings.push_back(absl::StrCat(dropped_step_count,
                                    dropped_step_count == 1 ? " step was" : " steps were",
                                    " not sent, because too many waited for the network"));
  }
  if (report.rejected_count() > 0) {
    warnings.push_back(absl::StrCat(Were(report.rejected_count()), " rejected, the last one with ",
                                    report.last_rejection().reason(), ": ",
                                    report.last_rejection().message()));
  }
  if (report.ahead_s() > report.scheduling_delay_s() + kUsualLeadS) {
    warnings.push_back(absl::StrFormat(
        "the newest step sounds only in %.3g s, because the simulation ran faster than real time: "
        "send each step when it happens, keep the scene until then, or render a trace by "
        "Client::Render",
        report.ahead_s()));
  }
  AddFindings(report.findings(), report.accepted_count() + report.late_count(), warnings);
  return warnings;
}

}  // namespace carillon::client
