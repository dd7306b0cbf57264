// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_conversion.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/column_conversion.h"
#include "server/api/convert/hertz_contact_conversion.h"
#include "server/api/convert/pose_conversion.h"

namespace carillon {
namespace {

Point ToArray(const v1::Vec3& vector) { return {vector.x(), vector.y(), vector.z()}; }

template <typename Number>
v1::Vec3 ToVec3(const std::array<Number, 3>& vector) {
  v1::Vec3 proto;
  proto.set_x(vector[0]);
  proto.set_y(vector[1]);
  proto.set_z(vector[2]);
  return proto;
}

SurfacePoint ToSurfacePoint(const v1::SurfacePoint& point) {
  return {.triangle = point.triangle(),
          .weights = {1 - point.weight1() - point.weight2(), point.weight1(), point.weight2()}};
}

/// Returns the location of a row's contact.
template <typename Row>
absl::StatusOr<std::variant<Point, SurfacePoint>> FromLocation(const Row& row) {
  if (row.has_point_m()) return ToArray(row.point_m());
  if (row.has_surface_point()) return ToSurfacePoint(row.surface_point());
  return Refusal(
      absl::StatusCode::kInvalidArgument, "LOCATION_MISSING",
      absl::StrCat("a contact on object ", row.object(), " has neither point_m nor surface_point"));
}

/// Fills in the fields that all kinds of contacts have. `vector` is an impulse or a force.
template <typename Row>
absl::Status ReadContact(const Row& row, const v1::Vec3& vector, ObjectContact& contact) {
  ASSIGN_OR_RETURN(contact.impulse.location, FromLocation(row));
  contact.handle = row.object();
  contact.impulse.impulse_newton_seconds = ToArray(vector);
  if (!row.has_second()) return absl::OkStatus();
  SecondObject& second = contact.second.emplace();
  ASSIGN_OR_RETURN(second.location, FromLocation(row.second()));
  second.handle = row.second().object();
  if (row.second().has_rotation()) second.rotation = FromProto(row.second().rotation());
  return absl::OkStatus();
}

Roughness FromProto(const v1::Roughness& proto) {
  Roughness roughness;
  roughness.travel_speed_m_per_s = proto.travel_speed_m_per_s();
  roughness.depth = proto.depth();
  if (proto.irregularity_length_m() != 0) {
    roughness.irregularity_length_m = proto.irregularity_length_m();
  }
  return roughness;
}

/// Reads the duration of a contact, or the figures of the collision that determine the duration.
template <typename Row>
absl::Status ReadDuration(const Row& row, ContactImpulse& impulse) {
  if (row.has_duration_s()) {
    impulse.duration_s = row.duration_s();
  } else if (row.has_hertz()) {
    ASSIGN_OR_RETURN(impulse.hertz, ToHertzContact(row.hertz()));
  }
  return absl::OkStatus();
}

absl::Status ReadInto(const v1::Impulse& row, ObjectImpulse& impulse) {
  RETURN_IF_ERROR(ReadContact(row, row.impulse_newton_seconds(), impulse.contact));
  RETURN_IF_ERROR(ReadDuration(row, impulse.contact.impulse));
  impulse.time_offset_s = row.time_offset_s();
  return absl::OkStatus();
}

absl::Status ReadInto(const v1::SustainedContact& row, ObjectForce& force) {
  RETURN_IF_ERROR(ReadContact(row, row.force_newtons(), force.contact));
  force.roughness = FromProto(row.roughness());
  return absl::OkStatus();
}

absl::Status ReadInto(const v1::EngineContact& row, ObjectTouch& touch) {
  RETURN_IF_ERROR(ReadContact(row, row.impulse_newton_seconds(), touch.contact));
  RETURN_IF_ERROR(ReadDuration(row, touch.contact.impulse));
  touch.time_offset_s = row.time_offset_s();
  touch.partner = row.partner();
  touch.roughness = FromProto(row.roughness());
  return absl::OkStatus();
}

/// Returns the place of report `index` of a list of `count`.
ReportPlace PlaceIn(const char* list, int count, int index) {
  return {.list = count > 1 ? list : nullptr, .index = static_cast<uint32_t>(index)};
}

/// Collects contacts and hands them to `take`, one of the intake's methods, many at a time.
template <typename Contact>
class Batch {
 public:
  Batch(ContactIntake& intake, void (ContactIntake::*take)(std::span<const Contact>), int count)
      : intake_(intake), take_(take) {
    contacts_.reserve(std::min(static_cast<size_t>(count), kMostContactsAtOnce));
  }

  /// Returns a contact to be filled in.
  Contact& Next() {
    if (contacts_.size() == kMostContactsAtOnce) Send();
    return contacts_.emplace_back();
  }

  /// Removes the newest contact.
  void Drop() { contacts_.pop_back(); }

  void Send() {
    if (!contacts_.empty()) (intake_.*take_)(contacts_);
    contacts_.clear();
  }

 private:
  ContactIntake& intake_;
  void (ContactIntake::*take_)(std::span<const Contact>);
  std::vector<Contact> contacts_;
};

/// Gives the rows of the field `list` to `take`, one of the intake's methods.
template <typename Contact, typename Rows>
void ReadRows(const char* list, const Rows& rows, ContactIntake& intake,
              void (ContactIntake::*take)(std::span<const Contact>)) {
  Batch<Contact> batch(intake, take, rows.size());
  for (int i = 0; i < rows.size(); ++i) {
    Contact& contact = batch.Next();
    absl::Status status = ReadInto(rows[i], contact);
    contact.contact.place = PlaceIn(list, rows.size(), i);
    if (status.ok()) continue;
    if (contact.contact.place.list != nullptr) status = AtElement(status, list, i);
    batch.Drop();
    batch.Send();  // the contacts before it come first, so that the last rejection stays the newest
    intake.Reject(rows[i].has_second() ? 2 : 1, std::move(status));
  }
  batch.Send();
}

const v1::ImpulseColumns& ImpulsesOf(const v1::ImpulseColumns& columns) { return columns; }
const v1::ImpulseColumns& ImpulsesOf(const v1::EngineContactColumns& columns) {
  return columns.impulses();
}

/// Gives the rows of the columns in the field `list` to `take`, with the duration of an elastic
/// collision where none is stated.
template <typename Contact, typename Columns>
void ReadColumns(const char* list, const Columns& columns, ContactIntake& intake,
                 void (ContactIntake::*take)(std::span<const Contact>)) {
  const v1::ImpulseColumns& impulses = ImpulsesOf(columns);
  absl::Status status = Validate(columns);
  const absl::StatusOr<HertzContact> hertz = ToHertzContact(impulses.hertz());
  status.Update(hertz.status());
  if (!status.ok()) {
    return intake.Reject(std::max<uint64_t>(1, CountContacts(impulses)), std::move(status));
  }
  Batch<Contact> batch(intake, take, impulses.object_size());
  for (int row = 0; row < impulses.object_size(); ++row) {
    Contact& contact = batch.Next();
    ReadRow(columns, row, contact);
    contact.contact.impulse.hertz = *hertz;
    contact.contact.place = PlaceIn(list, impulses.object_size(), row);
  }
  batch.Send();
}

void ReadColumns(const v1::PoseColumns& columns, ContactIntake& intake) {
  if (absl::Status status = Validate(columns); !status.ok()) {
    const auto count = static_cast<uint64_t>(columns.object_size());
    return intake.Reject(std::max<uint64_t>(1, count), std::move(status));
  }
  for (int row = 0; row < columns.object_size(); ++row) {
    intake.Move(columns.object(row), ReadRow(columns, row),
                PlaceIn("pose_columns", columns.object_size(), row));
  }
}

}  // namespace

ContactReading ToContactReading(v1::Frame frame, v1::PulseShape pulse_shape) {
  return {.scene_frame = frame == v1::FRAME_SCENE,
          .gaussian_pulses = pulse_shape == v1::PULSE_SHAPE_GAUSSIAN};
}

v1::ContactFindings ToProto(const IntakeFindings& findings) {
  v1::ContactFindings proto;
  proto.set_blow_count(findings.engine.blow_count);
  proto.set_load_count(findings.engine.load_count);
  return proto;
}

v1::Blow ToProto(const BlowRecord& blow) {
  v1::Blow proto;
  proto.set_time_s(blow.time_s);
  proto.set_object(blow.handle);
  if (blow.by && blow.by_sounds) proto.set_other_object(*blow.by);
  if (blow.by && !blow.by_sounds) proto.set_partner(*blow.by);
  *proto.mutable_point_m() = ToVec3(blow.point_m);
  *proto.mutable_impulse_newton_seconds() = ToVec3(blow.impulse_newton_seconds);
  proto.set_duration_s(blow.duration_s);
  return proto;
}

size_t CountRows(const v1::ContactStep& step) {
  const int rows = step.impulses_size() + step.columns().object_size() + step.sustained_size() +
                   step.contacts_size() + step.contact_columns().impulses().object_size() +
                   step.poses_size() + step.pose_columns().object_size();
  return static_cast<size_t>(rows);
}

absl::Status ReadStep(const v1::ContactStep& step, ContactIntake& intake) {
  RETURN_IF_ERROR(intake.BeginStep(step.time_s()));
  for (int i = 0; i < step.poses_size(); ++i) {
    intake.Move(step.poses(i).object(), FromProto(step.poses(i).pose()),
                PlaceIn("poses", step.poses_size(), i));
  }
  ReadColumns(step.pose_columns(), intake);
  if (step.has_listener()) intake.MoveListener(FromProto(step.listener()));
  ReadRows("impulses", step.impulses(), intake, &ContactIntake::Strike);
  ReadColumns("columns", step.columns(), intake, &ContactIntake::Strike);
  ReadRows("sustained", step.sustained(), intake, &ContactIntake::Hold);
  ReadRows("contacts", step.contacts(), intake, &ContactIntake::Touch);
  ReadColumns("contact_columns", step.contact_columns(), intake, &ContactIntake::Touch);
  intake.EndStep();
  return absl::OkStatus();
}

}  // namespace carillon
