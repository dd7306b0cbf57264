// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_warnings.h"

#include <array>
#include <cmath>
#include <cstddef>
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
/// Contacts without an impulse are a waste if there are so many, and this many times the others.
constexpr uint64_t kManyZeros = 1000, kMostZeros = 10;

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

/// Adds the warnings about the times of steps.
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
}

/// The warning about a mistake of an engine.
struct MistakeText {
  const char* id;
  const char* nouns;    // what the count counts
  const char* meaning;  // follows the count; the size of the mistake follows it
  const char* repair;
};

/// By EngineMistake.
constexpr std::array<MistakeText, kEngineMistakeCount> kMistakes{{
    {"IMPULSES_ARE_FORCES", "blows or steps of loads", "forces in place of impulses",
     "give newton seconds, which are newtons times the step"},
    {"CONTACTS_TWICE", "blows or contacts", "each contact twice",
     "leave out the second report of each pair, such as (b, a) beside (a, b)"},
    {"CONTACTS_STALE", "steps",
     "the impulse of an earlier step again, though the body does not feel it",
     "send an impulse only in the step in which the engine computed it"},
    {"LAST_SUBSTEP_ONLY", "blows or steps of loads", "the impulses of the last substep alone",
     "add up those of all substeps, or send each as a step"},
    {"IMPULSES_REVERSED", "blows or steps of loads", "the impulse on the other body",
     "change its sign"},
    {"IMPULSES_IN_OTHER_FRAME", "blows", "impulses in another frame than the stated one",
     "turn them, or state the frame of the scene or of the object"},
    {"CONTACTS_ONE_STEP_LATE", "blows", "impulses that acted a step or two before",
     "read them before the next step begins"},
    {"FIRST_IMPULSES_ZERO", "blows", "no impulse in the step in which the contact begins",
     "read impulses after the engine has solved its step"},
    {"MASSES_DIFFER", "blows", "impulses on a body of another mass than the object's",
     "give the engine the mass of the model, or the object the engine's density"},
}};

/// Returns whether the motion is a thousand times that of the impulses, and points lie far away.
bool CountsInMillimetres(const IntakeFindings& findings) {
  const MistakeSize& size = findings.mistakes[static_cast<size_t>(EngineMistake::kOtherMass)];
  return findings.distant_point_count > 0 && size.count > 0 &&
         std::abs(std::log(1000 * size.ratio)) < std::log(2);
}

/// Returns what to do about points that are far from the surface.
std::string WhyDistant(const IntakeFindings& findings) {
  if (CountsInMillimetres(findings)) {
    return "the objects moved a thousand times as fast as their impulses say, so that points and "
           "positions are probably in millimetres: give metres";
  }
  if (findings.lacks_poses) {
    return "the stated frame is the scene's, and no step had a pose of an object: send the poses "
           "in which you found the points";
  }
  return "give points in metres, in the frame that was stated, which is each object's own by "
         "default; if it is the scene's, give the poses of the objects, too, with quaternions w, "
         "x, y, z";
}

/// Adds the warnings about the engine's mistakes, by which the motion contradicts the impulses.
void AddMistakes(const IntakeFindings& findings, Warnings& warnings) {
  for (size_t i = 0; i < kMistakes.size(); ++i) {
    const MistakeSize& size = findings.mistakes[i];
    const bool is_of_units =
        i == static_cast<size_t>(EngineMistake::kOtherMass) && CountsInMillimetres(findings);
    if (size.count == 0 || is_of_units) continue;
    std::string ratio;
    if (size.ratio > 0) ratio = absl::StrFormat(", %.3g times the true impulses", size.ratio);
    const MistakeText& text = kMistakes[i];
    v1::Warning& warning =
        Add(warnings, text.id, size.count,
            absl::StrCat("by the balance of momentum, ", size.count, " ", text.nouns, " of object ",
                         size.handle, " and others show ", text.meaning, ratio, "; ", text.repair));
    if (size.ratio > 0) SetFigure(warning, "ratio", size.ratio);
    SetFigure(warning, "object", size.handle);
  }
}

bool Shows(const IntakeFindings& findings, EngineMistake mistake) {
  return findings.mistakes[static_cast<size_t>(mistake)].count > 0;
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
                     "gives steps no time, or is slower than real time: say so by time_scale, or "
                     "render a trace"));
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

/// Adds the warning about contacts that were refused. `Report` is that of a stream or a rendering.
template <class Report>
void AddRejection(const Report& report, Warnings& warnings) {
  if (report.rejected_count() == 0) return;
  Add(warnings, "CONTACTS_REJECTED", report.rejected_count(),
      absl::StrCat(Were(report.rejected_count()), " rejected, the last one with ",
                   report.last_rejection().reason(), ": ", report.last_rejection().message()));
}

/// Adds the warnings about contacts that are never heard.
void AddLossWarnings(const v1::StreamContactsResponse& report, Warnings& warnings) {
  if (report.dropped_count() > 0) {
    Add(warnings, "CONTACTS_DROPPED", report.dropped_count(),
        absl::StrCat(Were(report.dropped_count()),
                     " lost, because too many waited for the mixer, or because the object was "
                     "removed; send fewer contacts, and remove objects after their last contact"));
  }
  AddRejection(report, warnings);
}

}  // namespace

void AddContactWarnings(const IntakeFindings& findings, uint64_t accepted_count,
                        Warnings& warnings) {
  AddMistakes(findings, warnings);
  const uint64_t fast_count = findings.fast_impulse_count;
  if (fast_count > 0 && !Shows(findings, EngineMistake::kForces)) {
    const double largest_m_per_s = findings.largest_speed_change_m_per_s;
    v1::Warning& warning =
        Add(warnings, "IMPULSES_TOO_FAST", fast_count,
            absl::StrFormat("%s changed the speed of an object by up to %.3g m/s; give impulses in "
                            "newton seconds, which are forces times the step, and no forces",
                            Counted(fast_count, "contact"), largest_m_per_s));
    SetFigure(warning, "largest_speed_change_m_per_s", largest_m_per_s);
  }
  // An impact with an impulse of zero counts as accepted, once or twice for one or two objects.
  const uint64_t zeros = findings.zero_impulse_count;
  const uint64_t others = findings.engine.blow_count + findings.engine.load_count;
  const bool silent = others == 0 && 2 * zeros >= accepted_count;
  if (silent && zeros > 0 && !Shows(findings, EngineMistake::kFirstZero)) {
    Add(warnings, "IMPULSES_ZERO", zeros,
        absl::StrCat("the impulse of ", Counted(zeros, "contact"),
                     " was zero, and no other sounded; read impulses after the engine has solved "
                     "its step, and give newton seconds"));
  } else if (zeros >= kManyZeros && zeros >= kMostZeros * (others + accepted_count)) {
    Add(warnings, "IMPULSES_ZERO", zeros,
        absl::StrCat("the impulse of ", Counted(zeros, "contact"),
                     " was zero, nearly all that were sent; leave out pairs that do not touch"));
  }
  if (const uint64_t count = findings.distant_point_count; count > 0) {
    v1::Warning& warning = Add(
        warnings, "POINTS_DISTANT", count,
        absl::StrFormat("%s up to %.3g m away from the surface of the object, and sound%s at the "
                        "nearest point; %s",
                        absl::StrCat(Counted(count, "contact"), count == 1 ? " lies" : " lie"),
                        findings.largest_distance_m, count == 1 ? "s" : "", WhyDistant(findings)));
    SetFigure(warning, "largest_distance_m", findings.largest_distance_m);
  }
}

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
  AddRejection(summary, warnings);
  AddStepWarnings(findings, warnings);
  AddContactWarnings(findings, summary.accepted_count(), warnings);
}

}  // namespace carillon
