// SPDX-License-Identifier: Apache-2.0
#include "server/scene/contact_intake.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "server/scene/offline_renderer.h"
#include "server/scene/scene_registry.h"
#include "tests/server/scene/small_model.h"

namespace carillon {
namespace {

using ::testing::StartsWith;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kStepS = 0.01;

/// A report, and the reason for which it is rejected; none for a good one.
struct Report {
  std::function<void(ContactIntake&)> send;
  std::string reason;
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

Report Held(const Roughness& roughness, const std::string& reason = "") {
  const ObjectForce force{.contact = SmallImpulse(1).contact, .roughness = roughness};
  return {[force](ContactIntake& intake) { intake.Hold(force); }, reason};
}

Report Touched(const ObjectContact& contact, const Roughness& roughness,
               const std::string& reason = "") {
  const ObjectTouch touch{.contact = contact, .partner = 5, .roughness = roughness};
  return {[touch](ContactIntake& intake) { intake.Touch(touch); }, reason};
}

Report Moved(uint32_t handle, const Pose& pose, const std::string& reason = "") {
  return {[handle, pose](ContactIntake& intake) { intake.Move(handle, pose); }, reason};
}

Report Listened(const Pose& pose, const std::string& reason = "") {
  return {[pose](ContactIntake& intake) { intake.MoveListener(pose); }, reason};
}

/// Good reports and bad ones, several with two faults, of which the first that is checked counts.
std::vector<Report> Reports() {
  const Pose turned{.orientation = {.w = 2}};
  const SecondObject second{.handle = 2, .location = Point{0, 0, 0}};
  std::vector<Report> reports = {
      Struck(SmallImpulse(1)),
      Struck(SmallImpulse(9), "OBJECT_NOT_FOUND"),
      Struck(SmallImpulse(9, kNan, -1), "INVALID_TIME_OFFSET"),
      Struck(SmallImpulse(1, kNan), "IMPULSE_NOT_FINITE"),
      Struck(SmallImpulse(1, 1, kNan), "INVALID_TIME_OFFSET"),
      Struck(SmallImpulse(1, 1, 1e5), "TIME_TOO_FAR_AHEAD"),
      Spoilt(
          [](auto& it) {
            it.contact.impulse.location = Point{kNan, 0, 0};
          },
          "POINT_NOT_FINITE"),
      Spoilt([](auto& it) { it.contact.impulse.location = SurfacePoint{.triangle = 4}; },
             "TRIANGLE_OUT_OF_RANGE"),
      Spoilt([](auto& it) { it.contact.impulse.duration_s = 0.2; }, "INVALID_DURATION"),
      Spoilt([](auto& it) { it.contact.impulse.hertz.emplace(); }, "INVALID_HERTZ_CONTACT"),
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
      Held({}),
      Held({.depth = 11}, "INVALID_ROUGHNESS"),
      Touched(SmallImpulse(1).contact, {}),
      Touched(SmallImpulse(9).contact, {.depth = -1}, "INVALID_ROUGHNESS"),
      Touched(SmallImpulse(9).contact, {}, "OBJECT_NOT_FOUND"),
      Moved(1, {.position_m = {1, 2, 3}}),
      Moved(9, {}, "OBJECT_NOT_FOUND"),
      Moved(9, turned, "INVALID_POSE"),
      Listened({.position_m = {0, 0, 1}}),
      Listened(turned, "INVALID_POSE"),
  };
  return reports;
}

/// The verdict on each report: the status, and how many were rejected so far.
struct Verdicts {
  std::vector<std::string> statuses;
  std::vector<uint64_t> rejected_counts;
};

Verdicts Send(ContactIntake& intake) {
  Verdicts verdicts;
  uint64_t expected_count = 0;
  double time_s = 0;
  for (const Report& report : Reports()) {
    EXPECT_TRUE(intake.BeginStep(time_s += kStepS).ok());
    report.send(intake);
    intake.EndStep();
    if (!report.reason.empty()) {
      EXPECT_THAT(std::string(intake.last_rejection().message()), StartsWith(report.reason + ": "));
      expected_count += report.rejected_count;
    }
    EXPECT_EQ(intake.rejected_count(), expected_count) << report.reason;
    verdicts.statuses.push_back(intake.last_rejection().ToString());
    verdicts.rejected_counts.push_back(intake.rejected_count());
  }
  for (const double bad_time_s : {kNan, 0.0}) {
    verdicts.statuses.push_back(intake.BeginStep(bad_time_s).ToString());
  }
  return verdicts;
}

/// Messages name the scene, which live has a number, and the limit ahead, which offline is longer.
std::string ReasonOf(const std::string& status) { return status.substr(0, status.find(": ", 20)); }

TEST(ContactIntake, LiveAndOfflineGiveTheSameVerdictsForTheSameReasons) {
  Mixer mixer({.block_frame_count = OfflineRenderer::kBlockFrameCount});
  SceneRegistry scenes(mixer);
  const uint64_t scene = *scenes.CreateScene();
  BodyCache bodies;
  const auto renderer = *OfflineRenderer::Make({.tail_s = 0.1, .step_s = kStepS}, bodies);
  for (const uint32_t handle : {1U, 2U}) {
    ASSERT_TRUE(scenes.AddObject(scene, handle, SmallModel(), SmallProperties()).ok());
    ASSERT_TRUE(renderer->AddObject(handle, SmallModel(), SmallProperties()).ok());
  }
  const auto stream = *scenes.OpenContactStream(scene, {.step_s = kStepS});
  const Verdicts live = Send(stream->intake());
  const Verdicts offline = Send(renderer->intake());
  EXPECT_EQ(live.rejected_counts, offline.rejected_counts);
  ASSERT_EQ(live.statuses.size(), offline.statuses.size());
  for (size_t i = 0; i < live.statuses.size(); ++i) {
    EXPECT_EQ(ReasonOf(live.statuses[i]), ReasonOf(offline.statuses[i]));
  }
  std::vector<float> sound(size_t{48000} * 2);
  renderer->Render(sound);
  mixer.Render(std::span(sound).first(OfflineRenderer::kBlockFrameCount * 700));
  EXPECT_EQ(renderer->summary().rejected_count, stream->counts().rejected_count);
  EXPECT_EQ(renderer->summary().accepted_count, stream->counts().accepted_count);
  EXPECT_EQ(renderer->summary().last_rejection.code(), stream->last_rejection().code());
}

/// Keeps the events that an intake hands on.
class RecordingTarget final : public EventTarget {
 public:
  uint64_t frame() const override { return now; }
  void Push(const MixerEvent& event) override { events.push_back(event); }

  uint64_t now = 0;
  std::vector<MixerEvent> events;
};

TEST(ContactIntake, CountsTheImpulsesThatItHandsOn) {
  Mixer mixer;
  SceneRegistry scenes(mixer);
  Scene scene("a scene");
  const uint64_t registered = *scenes.CreateScene();
  ASSERT_TRUE(
      scene.Insert(1, scenes.AddObject(registered, 1, SmallModel(), SmallProperties())->object)
          .ok());
  RecordingTarget target;
  ContactIntake intake(scene, target, {.step_s = kStepS, .delay_s = 0.5});
  target.now = 4800;
  ASSERT_TRUE(intake.BeginStep(7).ok());
  intake.Strike(SmallImpulse(1, 1, 0.25));
  intake.Touch({.contact = SmallImpulse(1).contact, .partner = 2});  // from flight: a blow
  intake.EndStep();
  EXPECT_EQ(intake.impulse_count(), 2U);
  ASSERT_EQ(target.events.size(), 4U);  // the strike, the blow, its force of zero, and a knot
  EXPECT_EQ(target.events[0].frame, 4800 + 0.75 * 48000);
  EXPECT_EQ(target.events[1].frame, 4800 + 0.5 * 48000);
  // An object that was removed meanwhile feels no more forces.
  ASSERT_TRUE(scene.Remove(1).ok());
  ASSERT_TRUE(intake.BeginStep(7 + kStepS).ok());
  intake.EndStep();
  EXPECT_EQ(target.events.size(), 4U);
  EXPECT_TRUE(intake.last_rejection().ok());
}

}  // namespace
}  // namespace carillon
