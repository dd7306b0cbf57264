// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <initializer_list>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/striker_catalogue.h"
#include "server/api/convert/contact_conversion.h"
#include "server/api/convert/hertz_contact_conversion.h"

namespace carillon {
namespace {

using testing::HasSubstr;

/// The rows of a step, and what an intake of a scene without objects rejects of it.
struct Told {
  std::vector<ObjectImpulse> impulses;
  std::vector<Pose> poses;
  uint64_t rejected_count = 0;
  std::string rejection;
};

class NoTarget final : public EventTarget {
 public:
  uint64_t frame() const override { return 0; }
  void Push(const MixerEvent&) override {}
};

Told Read(const v1::ContactStep& step) {
  Told told;
  for (const v1::ContactColumns& columns : step.contact_columns()) {
    for (int row = 0; row < columns.object_size() && Validate(columns).ok(); ++row) {
      ReadRow(columns, row, told.impulses.emplace_back());
    }
  }
  const v1::PoseColumns& poses = step.poses();
  for (int row = 0; row < poses.object_size() && Validate(poses).ok(); ++row) {
    told.poses.push_back(ReadRow(poses, row));
  }
  Scene scene("an empty scene");
  NoTarget target;
  ContactIntake intake(scene, target, {.step_s = 0.01});
  EXPECT_TRUE(ReadStep(step, intake).ok());
  told.rejected_count = intake.rejected_count();
  told.rejection = intake.last_rejection().ToString();
  return told;
}

template <typename Column>
void Append(Column* column, std::initializer_list<float> numbers) {
  for (const float number : numbers) column->Add(number);
}

/// Three impacts of which two have a second object.
v1::ContactStep ThreeImpulses() {
  v1::ContactStep step;
  v1::ContactColumns& columns = *step.add_contact_columns();
  columns.set_kind(v1::CONTACT_KIND_IMPACT);
  for (const uint32_t second : {7U, 0U, 8U}) {
    columns.add_object(1);
    Append(columns.mutable_point_m(), {1, 2, 3});
    Append(columns.mutable_impulse_newton_seconds(), {4, 5, 6});
    columns.add_duration_s(0.001F);
    columns.add_time_offset_s(0.002F);
    columns.add_second_object(second);
    Append(columns.mutable_second_point_m(), {7, 8, 9});
  }
  Append(columns.mutable_second_rotation(), {0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  return step;
}

v1::ContactStep TwoPoses() {
  v1::ContactStep step;
  v1::PoseColumns& columns = *step.mutable_poses();
  columns.add_object(1);
  columns.add_object(2);
  for (const double x : {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}) columns.add_position_m(x);
  Append(columns.mutable_orientation(), {0, 1, 0, 0, 0, 0, 0, 0});
  return step;
}

TEST(Columns, AContactHasASecondObjectWhereItsHandleIsNotZero) {
  const Told told = Read(ThreeImpulses());
  ASSERT_EQ(told.impulses.size(), 3U);
  ASSERT_TRUE(told.impulses[0].contact.second.has_value());
  EXPECT_EQ(told.impulses[0].contact.second->handle, 7U);
  EXPECT_EQ(std::get<Point>(told.impulses[0].contact.second->location), (Point{7, 8, 9}));
  ASSERT_TRUE(told.impulses[0].contact.second->rotation.has_value());
  EXPECT_EQ(told.impulses[0].contact.second->rotation->y, 1);
  EXPECT_FALSE(told.impulses[1].contact.second.has_value());
  EXPECT_EQ(told.impulses[2].contact.second->handle, 8U);
  EXPECT_FALSE(
      told.impulses[2].contact.second->rotation.has_value());  // four zeros: as the poses say
}

TEST(Columns, WhatMayBeEmptyIsNone) {
  v1::ContactStep step = ThreeImpulses();
  v1::ContactColumns& columns = *step.mutable_contact_columns(0);
  columns.clear_second_rotation();
  EXPECT_FALSE(Read(step).impulses[0].contact.second->rotation.has_value());
  columns.clear_second_object();
  columns.clear_second_point_m();
  columns.clear_duration_s();
  columns.clear_time_offset_s();
  const Told told = Read(step);
  ASSERT_EQ(told.impulses.size(), 3U);
  EXPECT_FALSE(told.impulses[0].contact.second.has_value());
  EXPECT_FALSE(told.impulses[0].contact.impulse.duration_s.has_value());
}

TEST(Columns, PosesAreTurnedWhereTheColumnSaysSo) {
  v1::ContactStep step = TwoPoses();
  const Told told = Read(step);
  ASSERT_EQ(told.poses.size(), 2U);
  EXPECT_EQ(told.poses[1].position_m, (Vector3{4, 5, 6}));
  EXPECT_EQ(told.poses[0].orientation.x, 1);
  EXPECT_EQ(told.poses[1].orientation.w, 1);
  step.mutable_poses()->clear_orientation();
  EXPECT_EQ(Read(step).poses[0].orientation.w, 1);
}

TEST(Columns, AColumnOfAnotherLengthRejectsAllImpulsesAndIsNamed) {
  const auto expect = [](absl::string_view name, uint64_t rejected_count,
                         const std::function<void(v1::ContactColumns&)>& spoil) {
    v1::ContactStep step = ThreeImpulses();
    spoil(*step.mutable_contact_columns(0));
    const Told told = Read(step);
    EXPECT_TRUE(told.impulses.empty());
    EXPECT_EQ(told.rejected_count, rejected_count) << name;
    EXPECT_THAT(told.rejection, HasSubstr("CONTACT_MALFORMED: "));
    EXPECT_THAT(told.rejection, HasSubstr(absl::StrCat("column ", name, " has")));
  };
  // Three contacts, two of them of two objects: both count.
  expect("point_m", 5, [](auto& columns) { columns.add_point_m(0); });
  expect("impulse_newton_seconds", 5, [](auto& it) { it.clear_impulse_newton_seconds(); });
  expect("duration_s", 5, [](auto& columns) { columns.add_duration_s(0); });
  expect("time_offset_s", 5, [](auto& columns) { columns.add_time_offset_s(0); });
  expect("second_object", 6, [](auto& columns) { columns.add_second_object(9); });
  expect("second_point_m", 5, [](auto& columns) { columns.clear_second_point_m(); });
  expect("second_rotation", 5, [](auto& columns) { columns.add_second_rotation(1); });
  expect("second_point_m", 3, [](auto& columns) { columns.clear_second_object(); });
  expect("partner", 5, [](auto& columns) { columns.add_partner(1); });
  expect("travel_speed_m_per_s", 5, [](auto& columns) { columns.add_travel_speed_m_per_s(1); });
  expect("force_newtons", 5, [](auto& columns) {
    columns.set_kind(v1::CONTACT_KIND_FORCE);
    columns.clear_impulse_newton_seconds();
  });
}

TEST(Columns, ARejectionNamesItsRowUnlessThereIsOneOnly) {
  v1::ContactStep step = ThreeImpulses();
  EXPECT_THAT(Read(step).rejection, HasSubstr("OBJECT_NOT_FOUND: impacts[2]: an empty scene has "
                                              "no object 1, which is unknown"));
  step.mutable_contact_columns(0)->clear_kind();
  EXPECT_THAT(Read(step).rejection, HasSubstr("contacts[2]: an empty scene"));
  EXPECT_THAT(Read(TwoPoses()).rejection, HasSubstr("poses[1]: "));
  v1::ContactStep rows;
  rows.add_contacts()->set_object(1);
  EXPECT_THAT(Read(rows).rejection, HasSubstr("CONTACT_MALFORMED: a contact"));
  rows.add_contacts()->set_object(2);
  EXPECT_THAT(Read(rows).rejection,
              HasSubstr("CONTACT_MALFORMED: contacts[1]: a contact on object 2"));
}

/// A row with a point and with the vectors that are named.
v1::ContactStep Row(v1::ContactKind kind, bool has_impulse, bool has_force) {
  v1::ContactStep step;
  v1::Contact& row = *step.add_contacts();
  row.set_kind(kind);
  row.set_object(1);
  row.mutable_point_m();
  if (has_impulse) row.mutable_impulse_newton_seconds()->set_x(1);
  if (has_force) row.mutable_force_newtons()->set_x(1);
  return step;
}

TEST(Rows, NeedTheVectorOfTheirKind) {
  for (const auto kind : {v1::CONTACT_KIND_UNSPECIFIED, v1::CONTACT_KIND_REPORTED,
                          v1::CONTACT_KIND_IMPACT, v1::CONTACT_KIND_FORCE}) {
    const bool is_force = kind == v1::CONTACT_KIND_FORCE;
    EXPECT_THAT(Read(Row(kind, !is_force, is_force)).rejection, HasSubstr("OBJECT_NOT_FOUND"));
    EXPECT_THAT(Read(Row(kind, is_force, !is_force)).rejection, HasSubstr("CONTACT_MALFORMED"));
    EXPECT_THAT(Read(Row(kind, false, false)).rejection, HasSubstr("CONTACT_MALFORMED"));
  }
}

TEST(ColumnConversion, ReportedContactsHaveTheColumnsOfImpactsAndTheirOwn) {
  v1::ContactColumns columns = ThreeImpulses().contact_columns(0);
  columns.set_kind(v1::CONTACT_KIND_REPORTED);
  columns.set_roughness_depth(0.4);
  for (const uint32_t partner : {4U, 5U, 6U}) {
    columns.add_partner(partner);
    columns.add_travel_speed_m_per_s(static_cast<float>(partner) / 2);
    Append(columns.mutable_normal(), {0, 0, partner == 6 ? 2.0F : 0.0F});
  }
  ASSERT_TRUE(Validate(columns).ok());
  ObjectTouch touch;
  ReadRow(columns, 2, touch);
  EXPECT_EQ(touch.contact.second->handle, 8U);
  EXPECT_FLOAT_EQ(static_cast<float>(touch.time_offset_s), 0.002F);
  EXPECT_EQ(touch.partner, 6U);
  EXPECT_EQ(touch.contact.impulse.normal, (Vector3{0, 0, 2}));
  EXPECT_EQ(touch.roughness.travel_speed_m_per_s, 3);
  EXPECT_EQ(touch.roughness.depth, 0.4);
  EXPECT_EQ(touch.roughness.irregularity_length_m, 0.001);
  ReadRow(columns, 1, touch);
  EXPECT_EQ(touch.contact.impulse.normal, Vector3{});
  columns.mutable_partner()->RemoveLast();
  EXPECT_THAT(Validate(columns).ToString(), HasSubstr("CONTACT_MALFORMED: the column partner"));
}

TEST(ColumnConversion, ADurationBelowZeroIsAbsentAndAStrikerHoldsForAll) {
  v1::ContactStep step = ThreeImpulses();
  step.mutable_contact_columns(0)->set_duration_s(1, -1);
  step.mutable_contact_columns(0)->set_duration_s(2, 0);
  const Told told = Read(step);
  EXPECT_FLOAT_EQ(static_cast<float>(told.impulses[0].contact.impulse.duration_s.value()), 0.001F);
  EXPECT_EQ(told.impulses[1].contact.impulse.duration_s, std::nullopt);
  EXPECT_EQ(told.impulses[2].contact.impulse.duration_s, 0);
  step.mutable_contact_columns(0)->clear_duration_s();
  EXPECT_EQ(Read(step).impulses[2].contact.impulse.duration_s, std::nullopt);
  step.mutable_contact_columns(0)->mutable_hertz()->set_striker("stel");
  EXPECT_THAT(Read(step).rejection, HasSubstr("UNKNOWN_STRIKER"));
  EXPECT_THAT(Read(step).rejection, HasSubstr("the nearest is steel"));
}

/// Seconds on thick flat steel at 1 m/s or another speed.
double DurationS(const HertzContact& striker, double speed_m_per_s) {
  const ElasticBody wall{.young_pa = 2.06e11,
                         .poisson_ratio = 0.29,
                         .mass_kg = std::numeric_limits<double>::infinity()};
  HertzContact told = striker;
  told.approach_speed_m_per_s = speed_m_per_s;
  return HertzDurationS(wall, kSteelTip, told, 1);
}

TEST(HertzContactConversion, EveryStrikerHasFiguresASourceAndTheDurationThatItStates) {
  std::set<std::string> names;
  for (const v1::CatalogueStriker& striker : Strikers().strikers()) {
    EXPECT_TRUE(names.insert(striker.name()).second);
    v1::HertzContact named;
    named.set_striker(striker.name());
    const double speed_m_per_s = striker.name() == "felt" ? 2 : 1;
    const std::string& source = striker.source();
    const size_t unit = source.find(speed_m_per_s == 2 ? " ms at 2 m/s" : " ms at 1 m/s");
    ASSERT_NE(unit, std::string::npos) << striker.name();
    const double stated_ms = std::stod(source.substr(source.rfind(' ', unit - 1)));
    EXPECT_NEAR(1e3 * DurationS(*ToHertzContact(named), speed_m_per_s) / stated_ms, 1, 0.05)
        << striker.name();
  }
  EXPECT_EQ(names, (std::set<std::string>{"felt", "fingertip", "rubber", "steel", "wood"}));
}

TEST(HertzContactConversion, TheStrikerOfContactsThatNameNoneIsTheCataloguesSteel) {
  v1::HertzContact named;
  named.set_striker("steel");
  const HertzContact steel = *ToHertzContact(named);
  EXPECT_EQ(steel.striker_young_pa, kSteelTip.young_pa);
  EXPECT_EQ(steel.striker_poisson_ratio, kSteelTip.poisson_ratio);
  EXPECT_EQ(steel.striker_mass_kg, kSteelTip.mass_kg);
  EXPECT_EQ(steel.striker_radius_m, 1 / kSteelTip.curvature_per_m);
  EXPECT_TRUE(steel.striker_mass_is_named);
}

TEST(HertzContactConversion, FiguresOverrideThoseOfTheStriker) {
  v1::HertzContact named;
  named.set_striker("wood");
  named.set_striker_mass_kg(0.5);
  named.set_reduced_radius_m(0.25);
  const HertzContact hertz = *ToHertzContact(named);
  EXPECT_EQ(hertz.striker_mass_kg, 0.5);
  EXPECT_FALSE(hertz.striker_mass_is_named) << "only a stated mass counts as known";
  EXPECT_EQ(hertz.reduced_radius_m, 0.25);
  EXPECT_EQ(hertz.striker_radius_m, 0.005);
  EXPECT_FALSE(hertz.reduced_mass_kg);
  EXPECT_FALSE(ToHertzContact({})->striker_young_pa);
}

TEST(HertzContactConversion, AMaterialIsAFlatFloorThatDoesNotMove) {
  v1::HertzContact named;
  named.set_striker("concrete");
  named.set_striker_poisson_ratio(0.25);
  const HertzContact floor = *ToHertzContact(named);
  EXPECT_EQ(floor.striker_young_pa, 2.6e10);
  EXPECT_EQ(floor.striker_poisson_ratio, 0.25);
  EXPECT_FALSE(floor.striker_mass_is_named);
  const ElasticBody ball{
      .young_pa = 2e11, .poisson_ratio = 0.3, .mass_kg = 1, .curvature_per_m = 40};
  EXPECT_NEAR(ReducedMassKg(ball, kSteelTip, floor), 1, 1e-9);
  HertzContact same = floor;
  same.reduced_radius_m = 1.0 / 40;
  EXPECT_NEAR(HertzDurationS(ball, kSteelTip, floor, 1), HertzDurationS(ball, kSteelTip, same, 1),
              1e-12);
}

}  // namespace
}  // namespace carillon
