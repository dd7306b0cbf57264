// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace carillon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// The id, the count and the figures of each warning.
struct Told {
  std::string id;
  uint64_t count = 0;
  std::map<std::string, double> figures;
  bool operator==(const Told&) const = default;
};

std::vector<Told> ToldBy(const google::protobuf::RepeatedPtrField<v1::Warning>& warnings) {
  std::vector<Told> told;
  for (const v1::Warning& warning : warnings) {
    EXPECT_FALSE(warning.text().empty()) << warning.id();
    told.push_back(
        {warning.id(), warning.count(), {warning.figures().begin(), warning.figures().end()}});
  }
  return told;
}

std::vector<Told> WarningsOf(const IntakeFindings& findings,
                             v1::StreamContactsResponse report = {}) {
  AddWarnings(findings, report);
  return ToldBy(report.warnings());
}

TEST(ContactWarnings, AStreamThatSoundedAsMeantHasNone) {
  v1::StreamContactsResponse report;
  report.set_accepted_count(7);
  report.set_scheduling_delay_s(0.1);
  report.set_ahead_s(0.35);
  const IntakeFindings findings{.engine = {.blow_count = 4, .load_count = 90},
                                .largest_distance_m = 0.1,
                                .zero_impulse_count = 80,
                                .largest_speed_change_m_per_s = 3};
  EXPECT_THAT(WarningsOf(findings, report), IsEmpty());
}

TEST(ContactWarnings, EachFactHasAWarningWithItsCountAndFigures) {
  v1::StreamContactsResponse report;
  report.set_late_count(1);
  report.set_scheduling_delay_s(0.02);
  report.set_remap_count(2);
  report.set_dropped_count(3);
  report.set_rejected_count(1);
  report.set_ahead_s(0.28);
  report.mutable_last_rejection()->set_reason("CONTACT_MALFORMED");
  const IntakeFindings findings{.engine = {.blow_count = 1},
                                .distant_point_count = 5,
                                .largest_distance_m = 0.5,
                                .regular_gap_s = 1.0 / 120,
                                .fast_impulse_count = 2,
                                .largest_speed_change_m_per_s = 480,
                                .standing_step_count = 10};
  EXPECT_THAT(
      WarningsOf(findings, report),
      ElementsAre(Told{"CONTACTS_LATE", 1, {{"scheduling_delay_s", 0.02}}},
                  Told{"TIME_REMAPPED", 2, {}}, Told{"SIMULATION_AHEAD", 0, {{"ahead_s", 0.28}}},
                  Told{"CONTACTS_DROPPED", 3, {}}, Told{"CONTACTS_REJECTED", 1, {}},
                  Told{"STEP_TOO_SHORT", 0, {{"regular_gap_s", 1.0 / 120}}},
                  Told{"TIME_STANDS", 10, {}},
                  Told{"IMPULSES_TOO_FAST", 2, {{"largest_speed_change_m_per_s", 480}}},
                  Told{"POINTS_DISTANT", 5, {{"largest_distance_m", 0.5}}}));
}

TEST(ContactWarnings, ImpulsesOfZeroAreToldOnlyIfNoOthersSounded) {
  const auto told = [&](uint64_t load_count, uint64_t accepted_count, uint64_t blow_count) {
    v1::StreamContactsResponse counted;
    counted.set_accepted_count(accepted_count);
    return !WarningsOf({.engine = {.blow_count = blow_count, .load_count = load_count},
                        .zero_impulse_count = 12},
                       counted)
                .empty();
  };
  EXPECT_TRUE(told(0, 0, 0));    // engine's contacts
  EXPECT_TRUE(told(0, 12, 0));   // impacts on one object
  EXPECT_TRUE(told(0, 24, 0));   // impacts on two objects
  EXPECT_FALSE(told(1, 0, 0));   // a load sounded
  EXPECT_FALSE(told(0, 25, 0));  // an impact sounded
  EXPECT_FALSE(told(12, 1, 1));  // a blow sounded
}

TEST(ContactWarnings, ContactsWithoutImpulsesAreToldBesideOthersIfTheyAreNearlyAll) {
  const auto told = [](uint64_t zero_count, uint64_t load_count) {
    return WarningsOf(
        {.engine = {.blow_count = 1, .load_count = load_count}, .zero_impulse_count = zero_count});
  };
  EXPECT_THAT(told(60'000, 10), ElementsAre(Told{"IMPULSES_ZERO", 60'000, {}}));
  EXPECT_THAT(told(60'000, 6000), IsEmpty());
  EXPECT_THAT(told(999, 0), IsEmpty());
}

TEST(ContactWarnings, AMistakeOfTheEngineIsNamedWithItsSizeInPlaceOfAGuess) {
  IntakeFindings findings{
      .zero_impulse_count = 12, .fast_impulse_count = 2, .largest_speed_change_m_per_s = 480};
  findings.mistakes[static_cast<size_t>(EngineMistake::kForces)] = {
      .count = 5, .ratio = 240, .handle = 3};
  findings.mistakes[static_cast<size_t>(EngineMistake::kFirstZero)] = {.count = 4, .handle = 2};
  EXPECT_THAT(WarningsOf(findings),
              ElementsAre(Told{"IMPULSES_ARE_FORCES", 5, {{"object", 3}, {"ratio", 240}}},
                          Told{"FIRST_IMPULSES_ZERO", 4, {{"object", 2}}}));
}

TEST(ContactWarnings, PointsAreDistantForMillimetresOrForLackOfPoses) {
  IntakeFindings findings{.distant_point_count = 1, .largest_distance_m = 40};
  const auto why = [&] {
    google::protobuf::RepeatedPtrField<v1::Warning> warnings;
    AddContactWarnings(findings, 1, warnings);
    EXPECT_EQ(warnings.size(), 1);
    EXPECT_EQ(warnings[0].id(), "POINTS_DISTANT");
    return warnings[0].text();
  };
  EXPECT_THAT(why(), HasSubstr("quaternions w, x, y, z"));
  findings.lacks_poses = true;
  EXPECT_THAT(why(), HasSubstr("no step had a pose"));
  findings.mistakes[static_cast<size_t>(EngineMistake::kOtherMass)] = {
      .count = 7, .ratio = 0.00101, .handle = 1};
  EXPECT_THAT(why(), HasSubstr("millimetres"));
}

TEST(ContactWarnings, ARenderingHasThoseAboutItsContacts) {
  v1::RenderSummary empty;
  AddWarnings({}, empty);
  EXPECT_THAT(ToldBy(empty.warnings()), ElementsAre(Told{"TRACE_EMPTY", 0, {}}));
  v1::RenderSummary heard;
  heard.set_peak(0.1);  // of contact forces
  AddWarnings({}, heard);
  EXPECT_THAT(ToldBy(heard.warnings()), IsEmpty());
  v1::RenderSummary summary;
  summary.set_rejected_count(1);  // which ends the rendering in each client
  AddWarnings({.engine = {.blow_count = 1}, .distant_point_count = 1, .largest_distance_m = 2},
              summary);
  EXPECT_THAT(ToldBy(summary.warnings()),
              ElementsAre(Told{"CONTACTS_REJECTED", 1, {}},
                          Told{"POINTS_DISTANT", 1, {{"largest_distance_m", 2}}}));
}

}  // namespace
}  // namespace carillon
