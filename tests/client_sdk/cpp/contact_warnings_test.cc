// SPDX-License-Identifier: Apache-2.0
#include "carillon/contact_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace carillon::client {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

TEST(ContactWarningsTest, AStreamThatSoundedAsMeantGivesNone) {
  v1::StreamContactsResponse report;
  report.set_accepted_count(7);
  report.mutable_findings()->set_blow_count(4);
  report.mutable_findings()->set_load_count(90);
  report.mutable_findings()->set_zero_impulse_count(80);
  EXPECT_THAT(ContactWarnings(report), IsEmpty());
}

TEST(ContactWarningsTest, EachCountThatMeansAMistakeGivesASentence) {
  v1::StreamContactsResponse report;
  report.set_late_count(1);
  report.set_scheduling_delay_s(0.02);
  report.set_remap_count(2);
  report.set_dropped_count(3);
  report.set_rejected_count(1);
  report.mutable_last_rejection()->set_reason("POINT_NOT_FINITE");
  report.mutable_last_rejection()->set_message("send metres");
  report.mutable_findings()->set_regular_gap_s(1.0 / 120);
  report.mutable_findings()->set_standing_step_count(10);
  report.mutable_findings()->set_changed_partner_count(11);
  report.mutable_findings()->set_fast_impulse_count(2);
  report.mutable_findings()->set_largest_speed_change_m_per_s(480);
  report.mutable_findings()->set_distant_point_count(1);
  report.mutable_findings()->set_largest_distance_m(0.5);
  EXPECT_THAT(ContactWarnings(report, 4),
              ElementsAre(AllOf(StartsWith("1 contact was late"), HasSubstr("it was 0.02 s")),
                          HasSubstr("mapped anew 2 times"), StartsWith("3 contacts were lost"),
                          StartsWith("4 steps were not sent"),
                          "1 contact was rejected, the last one with POINT_NOT_FINITE: send metres",
                          StartsWith("most steps came 0.00833 s apart"),
                          StartsWith("10 steps with contacts had the time of the step before"),
                          StartsWith("in 11 steps an object in contact touched none"),
                          StartsWith("2 contacts changed the speed of an object by up to 480 m/s"),
                          StartsWith("1 contact lies up to 0.5 m away")));
}

TEST(ContactWarningsTest, ASimulationThatRanAheadOfItsSoundIsTold) {
  v1::StreamContactsResponse report;
  report.set_scheduling_delay_s(0.1);
  report.set_ahead_s(0.3);
  EXPECT_TRUE(ContactWarnings(report).empty());
  report.set_ahead_s(4);
  EXPECT_THAT(ContactWarnings(report),
              ElementsAre(StartsWith("the newest step sounds only in 4 s")));
}

TEST(ContactWarningsTest, ImpulsesThatAreAllZeroAreToldHoweverTheyWereSent) {
  v1::StreamContactsResponse loads;
  loads.mutable_findings()->set_zero_impulse_count(12);
  loads.mutable_findings()->set_load_count(12);
  EXPECT_THAT(ContactWarnings(loads),
              ElementsAre(StartsWith("the impulse of 12 contacts was zero")));
  v1::StreamContactsResponse impulses;
  impulses.mutable_findings()->set_zero_impulse_count(1);
  impulses.set_accepted_count(2);
  EXPECT_THAT(ContactWarnings(impulses),
              ElementsAre(StartsWith("the impulse of 1 contact was zero")));
  impulses.set_accepted_count(3);
  EXPECT_THAT(ContactWarnings(impulses), IsEmpty());
}

}  // namespace
}  // namespace carillon::client
