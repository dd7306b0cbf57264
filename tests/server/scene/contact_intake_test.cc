// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_intake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/scene/offline/offline_renderer.h"
#include "tests/server/scene/recording_target.h"

namespace carillon {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kStepS = 0.01;

/// A report, and the reason for which it is rejected; none for a good one.
struct Report {
  std::function<void(ContactIntake&)> send;
  std::string reason{};
  uint64_t rejected_count = 1;
};

Report Struck(const ObjectImpulse& impulse, const std::string& reason = "",
              uint64_t rejected_count = 1) {
  return {[impulse](ContactIntake& intake) { intake.Strike(impulse); }, reason, rejected_count};
}

Report Spoilt(const std::function<void(ObjectImpulse&)>& spoil, const std::string& reason,
              uint64_t rejected_count = 1) {
  ObjectImpulse impulse = SmallImpulse(1);
  spoil(impulse);
  return Struck(impulse, reason, rejected_count);
}

/// Good reports and bad ones, several with two faults, of which the first that is checked counts.
std::vector<Report> Reports() {
  const Pose turned{.orientation = {.w = 2}};
  const SecondObject second{.handle = 2, .location = Point{0, 0, 0}};
  const ObjectContact contact = SmallImpulse(1).contact, lost = SmallImpulse(9).contact;
  return {
      Struck(SmallImpulse(1)),
      Struck(SmallImpulse(9), "OBJECT_NOT_FOUND"),
      Struck(SmallImpulse(9, kNan, -1), "CONTACT_MALFORMED"),
      Struck(SmallImpulse(1, kNan), "CONTACT_MALFORMED"),
      Struck(SmallImpulse(1, 1, kNan), "CONTACT_MALFORMED"),
      Struck(SmallImpulse(1, 1, 1e5), "TIME_TOO_FAR_AHEAD"),
      Spoilt([](auto& it) { it.contact.impulse.location = Point{kNan}; }, "CONTACT_MALFORMED"),
      Spoilt([](auto& it) { it.contact.impulse.location = SurfacePoint{.triangle = 4}; },
             "CONTACT_MALFORMED"),
      Spoilt([](auto& it) { it.contact.impulse.duration_s = 0.2; }, "CONTACT_MALFORMED"),
      Spoilt([](auto& it) { it.contact.impulse.hertz.reduced_mass_kg = 0; }, "CONTACT_MALFORMED"),
      Spoilt([&](auto& it) { it.contact.second = second; }, ""),
      Spoilt([](auto& it) { it.contact.second = {.handle = 9, .location = Point{}}; },
             "OBJECT_NOT_FOUND", 2),
      Spoilt(
          [&](auto& it) {
            it.contact.second = second;
            it.contact.second->rotation = {.w = 2};
            it.contact.impulse.duration_s = 1;
          },
          "INVALID_POSE", 2),
      {[=](auto& intake) { intake.Hold({.contact = contact}); }},
      {[=](auto& intake) { intake.Hold({.contact = contact, .roughness = {.depth = 11}}); },
       "CONTACT_MALFORMED"},
      {[=](auto& intake) { intake.Touch({.contact = contact, .partner = 5}); }},
      {[=](auto& intake) { intake.Touch({.contact = lost, .roughness = {.depth = -1}}); },
       "CONTACT_MALFORMED"},
      {[=](auto& intake) { intake.Touch({.contact = lost}); }, "OBJECT_NOT_FOUND"},
      {[](auto& intake) {
        intake.Move(1, {.position_m = {1, 2, 3}});
      }},
      {[](auto& intake) { intake.Move(9, {}); }, "OBJECT_NOT_FOUND"},
      {[=](auto& intake) { intake.Move(9, turned); }, "INVALID_POSE"},
      {[](auto& intake) {
        intake.MoveListener({.position_m = {0, 0, 1}});
      }},
      {[=](auto& intake) { intake.MoveListener(turned); }, "INVALID_POSE"},
  };
}

/// Sends the reports, and returns the last rejection after each.
std::vector<absl::Status> Send(ContactIntake& intake) {
  std::vector<absl::Status> verdicts;
  uint64_t expected_count = 0;
  double time_s = 0;
  for (const Report& report : Reports()) {
    EXPECT_TRUE(intake.BeginStep(time_s += kStepS).ok());
    report.send(intake);
    intake.EndStep();
    if (!report.reason.empty()) {
      EXPECT_EQ(ReasonOf(intake.last_rejection()), report.reason);
      expected_count += report.rejected_count;
    }
    EXPECT_EQ(intake.rejected_count(), expected_count) << report.reason;
    verdicts.push_back(intake.last_rejection());
  }
  for (const double bad_time_s : {kNan, 0.0}) verdicts.push_back(intake.BeginStep(bad_time_s));
  return verdicts;
}

TEST(ContactIntake, LiveAndOfflineGiveTheSameVerdictsForTheSameReasons) {
  Stage stage;
  BodyCache bodies;
  const auto renderer = *OfflineRenderer::Make({.tail_s = 0.1, .step_s = kStepS}, bodies);
  for (const uint32_t handle : {1U, 2U}) {
    ASSERT_EQ(stage.Add(), handle);
    ASSERT_TRUE(renderer->forward().AddObject(handle, SmallModel(), SmallProperties()).ok());
  }
  const auto stream = stage.Open(std::nullopt);
  const std::vector<absl::Status> live = Send(stream->intake()), offline = Send(renderer->intake());
  ASSERT_EQ(live.size(), offline.size());
  for (size_t i = 0; i < live.size(); ++i) {
    EXPECT_EQ(live[i].code(), offline[i].code());
    EXPECT_EQ(ReasonOf(live[i]), ReasonOf(offline[i]));
  }
  stream->intake().Finish();
  renderer->forward().Finish();
  std::vector<float> sound(size_t{48000} * 2);
  renderer->Render(sound);
  stage.Render(700);
  EXPECT_EQ(renderer->summary().rejected_count, stream->counts().rejected_count);
  EXPECT_EQ(renderer->summary().accepted_count, stream->counts().accepted_count);
  EXPECT_EQ(stream->counts().accepted_count, 4U);  // a strike, one on two objects, and a blow
  EXPECT_EQ(renderer->summary().last_rejection.code(), stream->last_rejection().code());
}

TEST_F(RecordedSceneTest, CountsTheImpulsesThatItHandsOn) {
  ContactIntake intake(scene_, target_, {.step_s = kStepS, .delay_s = 0.5});
  target_.now = 4800;
  ASSERT_TRUE(intake.BeginStep(7).ok());
  intake.Strike(SmallImpulse(1, 1, 0.25));
  intake.Touch({.contact = SmallImpulse(1).contact, .partner = 2});  // from flight: a blow
  intake.EndStep();
  EXPECT_EQ(intake.impulse_count(), 2U);
  ASSERT_EQ(target_.events.size(), 4U);  // the strike, the blow, its force of zero, and a knot
  EXPECT_EQ(target_.events[0].frame, 4800 + 0.75 * 48000);
  EXPECT_EQ(target_.events[1].frame, 4800 + 0.5 * 48000);
  // An object that was removed meanwhile feels no more forces.
  ASSERT_TRUE(scene_.Remove(1).ok());
  ASSERT_TRUE(intake.BeginStep(7 + kStepS).ok());
  intake.EndStep();
  EXPECT_EQ(target_.events.size(), 4U);
  EXPECT_TRUE(intake.last_rejection().ok());
}

TEST_F(RecordedSceneTest, RejectsAllReportsOfAStepFarAhead) {
  ContactIntake intake(scene_, target_, {.step_s = kStepS});
  ASSERT_TRUE(intake.BeginStep(0).ok());
  intake.Hold({.contact = SmallImpulse(1).contact});
  intake.EndStep();
  target_.events.clear();
  ASSERT_TRUE(intake.BeginStep(1e9).ok());  // milliseconds, say, or a clock of another machine
  const size_t ended_count = target_.events.size();  // the force ends where it was last reported
  intake.Move(1, {});
  intake.MoveListener({});
  intake.Strike(SmallImpulse(1));
  intake.Hold({.contact = SmallImpulse(1).contact});
  intake.Touch({.contact = SmallImpulse(1).contact});
  intake.EndStep();
  EXPECT_EQ(intake.rejected_count(), 5U);
  const v1::ErrorInfo error = ToErrorInfo(intake.last_rejection());
  EXPECT_EQ(error.reason(), "TIME_TOO_FAR_AHEAD");
  EXPECT_EQ(error.metadata().at("time_s"), "1e+09");
  EXPECT_EQ(target_.events.size(), ended_count);
}

TEST_F(RecordedSceneTest, SaysWhenTheFirstOfSeveralRejectionsWas) {
  ContactIntake intake(scene_, target_, {.step_s = kStepS});
  for (const double time_s : {0.25, 0.5, 0.75}) StrikeAt(intake, time_s, {SmallImpulse(7)});
  const v1::ErrorInfo error = ToErrorInfo(intake.last_rejection());
  EXPECT_EQ(error.reason(), "OBJECT_NOT_FOUND");
  EXPECT_EQ(error.metadata().at("time_s"), "0.75");
  EXPECT_EQ(error.metadata().at("first_time_s"), "0.25");
}

class ReadingTest : public RecordedSceneTest {
 protected:
  ContactIntake Open(const ContactReading& reading) {
    ContactIntake intake(scene_, target_, {.step_s = kStepS, .reading = reading});
    EXPECT_TRUE(intake.BeginStep(0).ok());
    return intake;
  }

  /// The newest impulse, or one before it.
  const SurfaceImpulse& Newest(size_t back = 0) const {
    std::vector<const SurfaceImpulse*> impulses;
    for (const MixerEvent& event : target_.events) {
      if (event.impulse() != nullptr) impulses.push_back(event.impulse());
    }
    return *impulses.at(impulses.size() - 1 - back);
  }

  /// Returns what a strike becomes.
  const SurfaceImpulse& Strike(ContactIntake& intake, const ObjectImpulse& impulse) {
    intake.Strike(impulse);
    intake.EndStep();
    return Newest();
  }
};

TEST_F(ReadingTest, PointsAndImpulsesOfTheScenesFrameAreTurnedIntoTheObjects) {
  ContactIntake own = Open({}), shared = Open({.scene_frame = true});
  const Quaternion about_z{.w = std::sqrt(0.5), .z = std::sqrt(0.5)};  // x becomes y
  const Quaternion about_x{.w = std::sqrt(0.5), .x = std::sqrt(0.5)};  // y becomes z
  shared.Move(1, {.position_m = {5, 6, 7}, .orientation = about_z});
  shared.Move(2, {.position_m = {4, 6, 7}, .orientation = about_x});
  ObjectImpulse impulse = SmallImpulse(1);
  impulse.contact.impulse.location = Point{0.02, 0.03, 0};
  impulse.contact.impulse.impulse_newton_seconds = {1, 2, 3};
  impulse.contact.second = {.handle = 2, .location = Point{0, 0.01, 0.05}};
  const SurfaceImpulse second = Strike(own, impulse), first = Newest(1);
  impulse.contact.impulse.location = Point{5 - 0.03, 6 + 0.02, 7};
  impulse.contact.impulse.impulse_newton_seconds = {-2, 1, 3};
  impulse.contact.second->location = Point{4, 6 - 0.05, 7 + 0.01};
  impulse.contact.second->rotation = Quaternion{};  // ignored
  Strike(shared, impulse);
  ASSERT_EQ(target_.events.size(), 4U);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(Newest(1).at.weights[i], first.at.weights[i], 1e-6);
    EXPECT_NEAR(Newest().at.weights[i], second.at.weights[i], 1e-6);
    EXPECT_NEAR(Newest(1).impulse_newton_seconds[i], first.impulse_newton_seconds[i], 1e-6);
    EXPECT_NEAR(Newest().impulse_newton_seconds[i], second.impulse_newton_seconds[i], 1e-6);
  }
}

TEST_F(ReadingTest, AContactWithoutADurationIsElasticAndHasTheStreamsPulse) {
  ContactIntake cosine = Open({}), gaussian = Open({.gaussian_pulses = true});
  ObjectImpulse impulse = SmallImpulse(1, 0.02);
  impulse.contact.impulse.duration_s = std::nullopt;
  const Pulse hard = Strike(cosine, impulse).pulse;
  EXPECT_FALSE(hard.gaussian());
  EXPECT_GT(hard.duration_s(), 3e-5);
  EXPECT_LT(hard.duration_s(), 3e-4);
  EXPECT_EQ(Strike(gaussian, impulse).pulse, Pulse::Gaussian(hard.duration_s()));
  impulse.contact.impulse.hertz.striker_young_pa = 4e6;
  EXPECT_GT(Strike(cosine, impulse).pulse.duration_s(), 10 * hard.duration_s());
  // A second object strikes with all of its 0.45 kg.
  impulse.contact.impulse.hertz = {};
  impulse.contact.second = {.handle = 2, .location = Point{0, 0, 0}};
  EXPECT_GT(Strike(cosine, impulse).pulse.duration_s(), 2 * hard.duration_s());
  EXPECT_EQ(Newest().pulse, Newest(1).pulse);
}

TEST_F(ReadingTest, FrictionDoesNotShortenAContactWhoseNormalIsKnown) {
  ContactIntake own = Open({}), shared = Open({.scene_frame = true});
  ObjectImpulse impulse = SmallImpulse(1, 0.02);
  impulse.contact.impulse.duration_s = std::nullopt;
  const auto lasting_s = [&](ContactIntake& intake, const Vector3& newton_seconds,
                             const Vector3& normal) {
    impulse.contact.impulse.impulse_newton_seconds = newton_seconds;
    impulse.contact.impulse.normal = normal;
    return Strike(intake, impulse).pulse.duration_s();
  };
  const float straight_s = lasting_s(own, {0.02, 0, 0}, {});
  const float oblique_s = lasting_s(own, {0.02, 0.016, 0}, {});
  EXPECT_LT(oblique_s, 0.99F * straight_s);
  for (const double length :
       {-3.0, 0.1, 1e-300, 1e300}) {  // Neither its sense nor its length has an effect.
    EXPECT_NEAR(lasting_s(own, {0.02, 0.016, 0}, Vector3{length, 0, 0}), straight_s, 1e-9F);
  }
  // A normal across the impulse cannot be right.
  EXPECT_EQ(lasting_s(own, {0.02, 0.016, 0}, Vector3{0, 0, 1}), oblique_s);
  shared.Move(1, {.orientation = {.w = std::sqrt(0.5), .z = std::sqrt(0.5)}});  // x becomes y
  EXPECT_NEAR(lasting_s(shared, {-0.016, 0.02, 0}, Vector3{0, 1, 0}), straight_s, 1e-9F);
}

TEST_F(ReadingTest, TheModesOfAThinBodyYieldToABlowWithoutADuration) {
  auto thin = std::make_shared<ModalModel>(*SmallModel());
  thin->digest = std::string(64, 'b');
  for (float& shape : thin->shapes) shape *= 77;  // as if each mode moved the whole body alike
  model = thin;
  ASSERT_TRUE(scene_.Insert(3, Made()).ok());
  ContactIntake cosine = Open({}), gaussian = Open({.gaussian_pulses = true});
  ObjectImpulse impulse = SmallImpulse(3, 0.02);
  EXPECT_TRUE(Strike(cosine, impulse).gains.none());  // the duration is stated
  impulse.contact.impulse.duration_s = std::nullopt;
  EXPECT_TRUE(Strike(gaussian, impulse).gains.none());
  const OctaveGains gains = Strike(cosine, impulse).gains;
  EXPECT_LT(gains.Factor(OctaveGains::OctaveOf(kTestFrequenciesHz[0])), 1);
  cosine.Touch({.contact = impulse.contact});
  cosine.EndStep();
  EXPECT_EQ(Newest().gains, gains);
  impulse.contact.handle = 1;  // whose modes hardly move it
  EXPECT_TRUE(Strike(cosine, impulse).gains.none());
}

TEST_F(ReadingTest, ABodyThatFallsStrikesAtTheSpeedOfItsPoses) {
  const auto lands = [&](double newton_seconds, std::optional<double> stated_m_per_s) {
    ContactIntake intake(scene_, target_, {.step_s = kStepS});
    double height_m = 10;
    for (int step = 1; step <= 40; ++step) {
      EXPECT_TRUE(intake.BeginStep(step * kStepS).ok());
      if (step < 40) height_m -= 9.81 * kStepS * kStepS * step;
      if (!stated_m_per_s) intake.Move(1, {.position_m = {height_m, 0, 0}});
      ObjectTouch touch{.contact = SmallImpulse(1, newton_seconds).contact};
      touch.contact.impulse.duration_s = std::nullopt;
      touch.contact.impulse.hertz = {.approach_speed_m_per_s = stated_m_per_s,
                                     .striker_mass_kg = 1e6};
      if (step == 40) intake.Touch(touch);
      intake.EndStep();
    }
    intake.Finish();
    return double{Newest().pulse.duration_s()};
  };
  // At its corner the tetrahedron of 0.45 kg meets the floor with a third of its mass.
  const double speed = 9.81 * kStepS * 40;
  for (const double impulse : {0.15 * speed, 0.25 * speed}) {
    EXPECT_NEAR(lands(impulse, std::nullopt) / lands(impulse, speed), 1, 1e-5) << impulse;
  }
}

TEST_F(ReadingTest, AStepThatIsStatedTooShortIsFound) {
  ContactIntake intake = Open({});
  for (int i = 0; i < 12; ++i) ASSERT_TRUE(intake.BeginStep(i * 8 * kStepS).ok());
  EXPECT_NEAR(intake.findings().regular_gap_s, 8 * kStepS, 1e-12);
}

TEST_F(ReadingTest, StepsWithTouchesAtTheTimeOfTheStepBeforeAreCounted) {
  ContactIntake intake = Open({});
  ObjectTouch touch{.contact = SmallImpulse(1, 0.1).contact, .partner = 9};
  const auto step = [&](double time_s, bool touches) {
    EXPECT_TRUE(intake.BeginStep(time_s).ok());
    if (touches) intake.Touch(touch);
    if (touches) intake.Touch(touch);
    if (!touches) intake.Strike(SmallImpulse(1, 0.1));
    intake.EndStep();
    return intake.findings().standing_step_count;
  };
  // Open has begun a step at zero. Ten standing steps count, but no strikes.
  for (int i = 0; i < 9; ++i) EXPECT_EQ(step(0, true), 0U);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(step(0, false), 0U);
  EXPECT_EQ(step(0, true), 10U);
  // They count as long as they are a fifth of all steps with touches.
  for (int i = 1; i <= 40; ++i) EXPECT_EQ(step(i * kStepS, true), 10U);
  EXPECT_EQ(step(41 * kStepS, true), 0U);
}

TEST_F(ReadingTest, ImpulsesThatAreProbablyForcesAreCounted) {
  ContactIntake intake = Open({});
  for (const double impulse : {0.45, 44.0, 46.0, 0.45, 60.0, 50.0}) {
    intake.Strike(SmallImpulse(1, impulse));
  }
  EXPECT_EQ(intake.findings().fast_impulse_count, 3U);
  EXPECT_NEAR(intake.findings().largest_speed_change_m_per_s, 60 / 0.45, 3);
}

TEST_F(ReadingTest, HowFarASimulationRunsAheadOfTheSoundIsKnown) {
  ContactIntake intake = Open({});
  EXPECT_EQ(intake.ahead_s(), 0);
  ASSERT_TRUE(intake.BeginStep(1).ok());
  const double delay_s = intake.ahead_s();
  ASSERT_TRUE(intake.BeginStep(4).ok());
  EXPECT_NEAR(intake.ahead_s(), delay_s + 3, 1e-9);
  ASSERT_TRUE(intake.BeginStep(86400).ok());
  EXPECT_EQ(intake.ahead_s(), 0) << "though the step never sounds";
}

TEST_F(ReadingTest, WhatIsStrangeAboutContactsIsCountedAndWhatNoBodyBearsIsRefused) {
  ContactIntake intake = Open({});
  ObjectImpulse distant = SmallImpulse(1);
  distant.contact.impulse.location = Point{-0.3, 0, 0};
  intake.Strike(distant);
  intake.Strike(SmallImpulse(1, 0));
  intake.EndStep();
  EXPECT_EQ(target_.events.size(), 2U);
  // 0.45 kg, sound at 5.1 km/s.
  intake.Strike(SmallImpulse(1, 2.2e4));
  EXPECT_TRUE(intake.last_rejection().ok());
  intake.Strike(SmallImpulse(1, 2.4e4));
  EXPECT_EQ(ReasonOf(intake.last_rejection()), "IMPULSE_TOO_LARGE");
  intake.Hold({.contact = SmallImpulse(1, 1e20).contact});
  intake.Touch({.contact = SmallImpulse(1, 1e20).contact});
  intake.Touch({.contact = SmallImpulse(1).contact, .time_offset_s = -1});
  EXPECT_EQ(ReasonOf(intake.last_rejection()), "CONTACT_MALFORMED");
  intake.Touch({.contact = SmallImpulse(1).contact, .time_offset_s = 0.003});
  intake.EndStep();
  const IntakeFindings findings = intake.findings();
  EXPECT_EQ(findings.distant_point_count, 1U);
  EXPECT_NEAR(findings.largest_distance_m, 0.3, 1e-6);
  EXPECT_EQ(findings.zero_impulse_count, 1U);
  EXPECT_EQ(findings.too_large_impulse_count, 3U);
  EXPECT_EQ(findings.fast_impulse_count, 1U);
  EXPECT_NEAR(findings.largest_speed_change_m_per_s, 2.2e4 / 0.45, 2e3);
  EXPECT_EQ(findings.engine.blow_count, 1U);
  EXPECT_EQ(intake.rejected_count(), 4U);
  const auto is_offset = [](const MixerEvent& event) { return event.frame == 144; };
  EXPECT_TRUE(std::ranges::any_of(target_.events, is_offset));  // the blow, 3 ms after the step
}

class ChangedSceneTest : public RecordedSceneTest {
 protected:
  std::vector<BlowRecord> blows_;
  ContactIntake intake_{scene_, target_, {.step_s = 0.01, .blows = &blows_}};
};

TEST_F(ChangedSceneTest, AnImpulseOnAnObjectThatIsRemovedBeforeTheStepEndsIsRejected) {
  // Another object that gets the handle meanwhile may have another surface.
  for (const bool another_comes : {true, false}) {
    ASSERT_TRUE(intake_.BeginStep(another_comes ? 0 : 1).ok());
    intake_.Strike(SmallImpulse(1));
    intake_.Touch({.contact = SmallImpulse(1).contact, .partner = 2});
    intake_.Hold({.contact = SmallImpulse(1).contact});
    ASSERT_TRUE(scene_.Remove(1).ok());
    if (another_comes) {
      ASSERT_TRUE(scene_.Insert(1, Made()).ok());
    }
    intake_.Strike(SmallImpulse(1));  // added to the first, whose point it strikes
    const uint64_t rejected_before = intake_.rejected_count();
    intake_.EndStep();
    EXPECT_EQ(target_.events.size(), 0U);
    EXPECT_EQ(intake_.impulse_count(), 0U);
    EXPECT_EQ(intake_.rejected_count(), rejected_before + 2);
    EXPECT_EQ(ReasonOf(intake_.last_rejection()), "OBJECT_NOT_FOUND");
  }
  EXPECT_EQ(blows_.size(), 2U) << "the impulses on the objects that were there";
}

TEST_F(ChangedSceneTest, AnImpulseOnAnObjectThatIsChangedBeforeTheStepEndsGoesToTheNewBank) {
  ASSERT_TRUE(intake_.BeginStep(0).ok());
  intake_.Strike(SmallImpulse(1));
  const SoundingObject changed = Made();
  ASSERT_TRUE(scene_.Replace(1, changed).ok());
  intake_.EndStep();
  ASSERT_EQ(target_.events.size(), 1U);
  EXPECT_EQ(target_.events[0].bank, changed.bank);
  EXPECT_EQ(intake_.impulse_count(), 1U);
}

}  // namespace
}  // namespace carillon
