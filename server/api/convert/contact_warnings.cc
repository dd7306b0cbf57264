// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_warnings.h"

#include <cstdint>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace carillon {
namespace {

using Warnings = google::protobuf::RepeatedPtrField<v1::Warning>;

/// Time by which a simulation in real time may run ahead.
constexpr double kUsualLeadS = 0.25;

v1::Warning& Add(Warnings& warnings, const char* id, uint64_t count, std::string text) {
  v1::Warning& warning = *warnings.Add();
  warning.set_id(id);
  warning.set_count(count);
  warning.set_text(std::move(text));
  return warning;
}

void SetFigure(v1::Warning& warning, const char* name, double value) {
  (*warning.mutable_figures())[name] = value;
}

std::string Counted(uint64_t count, absl::string_view noun) {
  return absl::StrCat(count, " ", noun, count == 1 ? "" : "s");
}

std::string Were(uint64_t count) {
  return absl::StrCat(Counted(count, "contact"), count == 1 ? " was" : " were");
}

/// Adds the warnings about the times of steps and about partners, by which bodies at rest strike.
void AddStepWarnings(const IntakeFindings& findings, Warnings& warnings) {
  if (findings.regular_gap_s > 0) {
    v1::Warning& warning = Add(
        warnings, "STEP_TOO_SHORT", 0,
        absl::StrFormat("most steps came %.3g s apart, which is longer than the step that was "
                        "stated, so that a body at rest strikes in each of them; state the step "
                        "of the simulator and the times of steps in seconds",
                        findings.regular_gap_s));
    SetFigure(warning, "regular_gap_s", findings.regular_gap_s);
  }
  if (const uint64_t count = findings.standing_step_count; count > 0) {
    Add(warnings, "TIME_STANDS", count,
        absl::StrCat(count,
                     " steps with contacts had the time of the step before; give each step the "
                     "simulation's time, in seconds"));
  }
  if (const uint64_t count = findings.engine.changed_partner_count; count > 0) {
    Add(warnings, "PARTNERS_CHANGE", count,
        absl::StrCat("in ", count,
                     " steps an object in contact touched none of its partners of the step "
                     "before, so that a body at rest strikes in each of them; give a body the "
                     "same partner in each step, such as the engine's number of that body"));
  }
}

/// Adds the warnings about impulses and points.
void AddContactWarnings(const IntakeFindings& findings, uint64_t accepted_count,
                        Warnings& warnings) {
  if (const uint64_t count = findings.fast_impulse_count; count > 0) {
    const double largest_m_per_s = findings.largest_speed_change_m_per_s;
    v1::Warning& warning =
        Add(warnings, "IMPULSES_TOO_FAST", count,
            absl::StrFormat("%s changed the speed of an object by up to %.3g m/s; give impulses in "
                            "newton seconds, which are forces times the step, and no forces",
                            Counted(count, "contact"), largest_m_per_s));
    SetFigure(warning, "largest_speed_change_m_per_s", largest_m_per_s);
  }
  // An engine's contact without an impulse counts as a load, and an impact with an impulse of zero
  // counts as accepted, once or twice for one or two objects.
  const uint64_t zeros = findings.zero_impulse_count;
  if (zeros > 0 && findings.engine.blow_count == 0 && zeros >= findings.engine.load_count &&
      2 * zeros >= accepted_count) {
    Add(warnings, "IMPULSES_ZERO", zeros,
        absl::StrCat("the impulse of ", Counted(zeros, "contact"),
                     " was zero, and no other sounded; read impulses after the engine has solved "
                     "its step, and give newton seconds"));
  }
  if (const uint64_t count = findings.distant_point_count; count > 0) {
    v1::Warning& warning = Add(
        warnings, "POINTS_DISTANT", count,
        absl::StrFormat("%s up to %.3g m away from the surface of the object, and sound%s at the "
                        "nearest point; give points in metres, in the frame that was stated, "
                        "which is each object's own by default; if it is the scene's, give the "
                        "poses of the objects, too",
                        absl::StrCat(Counted(count, "contact"), count == 1 ? " lies" : " lie"),
                        findings.largest_distance_m, count == 1 ? "s" : ""));
    SetFigure(warning, "largest_distance_m", findings.largest_distance_m);
  }
}

/// Adds the warnings about contacts that were not heard in time.
void AddTimeWarnings(const v1::StreamContactsResponse& report, Warnings& warnings) {
  if (report.late_count() > 0) {
    v1::Warning& warning =
        Add(warnings, "CONTACTS_LATE", report.late_count(),
            absl::StrFormat("%s late, and sounded at once instead of at the right time; send each "
                            "step when it happens, or open the stream with a longer scheduling "
                            "delay (it was %.3g s)",
                            Were(report.late_count()), report.scheduling_delay_s()));
    SetFigure(warning, "scheduling_delay_s", report.scheduling_delay_s());
  }
  if (report.remap_count() > 0) {
    Add(warnings, "TIME_REMAPPED", report.remap_count(),
        absl::StrCat("simulation time was mapped anew ", Counted(report.remap_count(), "time"),
                     ", because every step of a quarter of a second was late; the simulator "
                     "paused, gives steps no time, or is slower than real time, for which "
                     "rendering a trace suits"));
  }
  if (report.ahead_s() > report.scheduling_delay_s() + kUsualLeadS) {
    v1::Warning& warning =
        Add(warnings, "SIMULATION_AHEAD", 0,
            absl::StrFormat("the newest step sounds only in %.3g s, because the simulation ran "
                            "faster than real time; send each step when it happens, keep the "
                            "scene until then, or render a trace",
                            report.ahead_s()));
    SetFigure(warning, "ahead_s", report.ahead_s());
  }
}

/// Adds the warnings about contacts that are never heard.
void AddLossWarnings(const v1::StreamContactsResponse& report, Warnings& warnings) {
  if (report.dropped_count() > 0) {
    Add(warnings, "CONTACTS_DROPPED", report.dropped_count(),
        absl::StrCat(Were(report.dropped_count()),
                     " lost, because too many waited for the mixer, or because the object was "
                     "removed; send fewer contacts, and remove objects after their last contact"));
  }
  if (report.rejected_count() > 0) {
    Add(warnings, "CONTACTS_REJECTED", report.rejected_count(),
        absl::StrCat(Were(report.rejected_count()), " rejected, the last one with ",
                     report.last_rejection().reason(), ": ", report.last_rejection().message()));
  }
}

}  // namespace

void AddWarnings(const IntakeFindings& findings, v1::StreamContactsResponse& report) {
  Warnings& warnings = *report.mutable_warnings();
  AddTimeWarnings(report, warnings);
  AddLossWarnings(report, warnings);
  AddStepWarnings(findings, warnings);
  AddContactWarnings(findings, report.accepted_count() + report.late_count(), warnings);
}

void AddWarnings(const IntakeFindings& findings, v1::RenderSummary& summary) {
  Warnings& warnings = *summary.mutable_warnings();
  const uint64_t contact_count = summary.accepted_count() + summary.rejected_count() +
                                 findings.engine.load_count + findings.zero_impulse_count +
                                 findings.too_large_impulse_count;
  if (contact_count == 0 && summary.peak() == 0) {  // contact forces are not counted, but heard
    Add(warnings, "TRACE_EMPTY", 0,
        "the trace holds no contact, so there is nothing to hear; record a simulation in which "
        "something is struck");
  }
  AddStepWarnings(findings, warnings);
  AddContactWarnings(findings, summary.accepted_count(), warnings);
}

}  // namespace carillon
