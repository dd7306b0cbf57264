// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/contact_conversion.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/contact_fields.h"
#include "server/api/convert/hertz_contact_conversion.h"
#include "server/api/convert/pose_conversion.h"

namespace carillon {
namespace {

template <typename Number>
v1::Vec3 ToVec3(const std::array<Number, 3>& vector) {
  v1::Vec3 proto;
  proto.set_x(vector[0]);
  proto.set_y(vector[1]);
  proto.set_z(vector[2]);
  return proto;
}

/// Returns the place of report `index` of a list of `count`.
ReportPlace PlaceIn(const char* list, int count, int index) {
  return {.list = count > 1 ? list : nullptr, .index = static_cast<uint32_t>(index)};
}

/// Collects contacts of one kind and hands them to `take`, one of the intake's methods, many at a
/// time.
template <typename Contact>
class Batch {
 public:
  using Take = void (ContactIntake::*)(std::span<const Contact>);

  Batch(ContactIntake& intake, Take take) : intake_(intake), take_(take) {}

  /// Returns a contact to be filled in. `left_count` is the number of contacts that may follow.
  Contact& Next(int left_count) {
    if (contacts_.size() == kMostContactsAtOnce) Send();
    if (contacts_.empty()) {
      contacts_.reserve(std::min(static_cast<size_t>(left_count), kMostContactsAtOnce));
    }
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
  Take take_;
  std::vector<Contact> contacts_;
};

/// The contacts of a step, each in the batch of its kind.
class ContactBatches {
 public:
  explicit ContactBatches(ContactIntake& intake)
      : impacts_(intake, &ContactIntake::Strike),
        forces_(intake, &ContactIntake::Hold),
        reported_(intake, &ContactIntake::Touch) {}

  /// Calls `read` with the batch of a kind, and returns its result. Errors: those of KindOf.
  template <typename Read>
  absl::Status Visit(v1::ContactKind kind, const Read& read) {
    ASSIGN_OR_RETURN(const v1::ContactKind known, KindOf(kind));
    if (known == v1::CONTACT_KIND_IMPACT) return read(impacts_);
    if (known == v1::CONTACT_KIND_FORCE) return read(forces_);
    return read(reported_);
  }

  void Send() {
    impacts_.Send();
    forces_.Send();
    reported_.Send();
  }

 private:
  Batch<ObjectImpulse> impacts_;
  Batch<ObjectForce> forces_;
  Batch<ObjectTouch> reported_;
};

void ReadRows(const v1::ContactStep& step, ContactIntake& intake) {
  constexpr char kList[] = "contacts";
  const int count = step.contacts_size();
  ContactBatches batches(intake);
  for (int i = 0; i < count; ++i) {
    const v1::Contact& row = step.contacts(i);
    absl::Status status = batches.Visit(row.kind(), [&](auto& batch) {
      auto& contact = batch.Next(count - i);
      absl::Status read = ReadRow(row, contact);
      contact.contact.place = PlaceIn(kList, count, i);
      if (!read.ok()) batch.Drop();
      return read;
    });
    if (status.ok()) continue;
    if (count > 1) status = AtElement(status, kList, static_cast<size_t>(i));
    batches.Send();  // the contacts before it come first, so that the last rejection is the newest
    intake.Reject(row.has_second() ? 2 : 1, std::move(status));
  }
  batches.Send();
}

/// Returns the name by which a rejection calls contacts of a kind.
const char* ListOf(v1::ContactKind kind) {
  if (kind == v1::CONTACT_KIND_IMPACT) return "impacts";
  return kind == v1::CONTACT_KIND_FORCE ? "forces" : "contacts";
}

/// Reads the rows row_of(0) to row_of(row_count - 1) of columns, which are valid. Errors: those of
/// KindOf.
template <typename RowOf>
absl::Status TryReadRows(const v1::ContactColumns& columns, int row_count, const RowOf& row_of,
                         const HertzContact& hertz, ContactIntake& intake) {
  ContactBatches batches(intake);
  absl::Status status = batches.Visit(columns.kind(), [&](auto& batch) {
    for (int i = 0; i < row_count; ++i) {
      const int row = row_of(i);
      auto& contact = batch.Next(row_count - i);
      ReadRow(columns, row, contact);
      contact.contact.impulse.hertz = hertz;
      contact.contact.place = PlaceIn(ListOf(columns.kind()), columns.object_size(), row);
    }
    return absl::OkStatus();
  });
  batches.Send();
  return status;
}

absl::Status TryReadColumns(const v1::ContactColumns& columns, ContactIntake& intake) {
  RETURN_IF_ERROR(KindOf(columns.kind()).status());
  RETURN_IF_ERROR(Validate(columns));
  ASSIGN_OR_RETURN(const HertzContact hertz, ToHertzContact(columns.hertz()));
  const auto same = [](int row) { return row; };
  return TryReadRows(columns, columns.object_size(), same, hertz, intake);
}

/// Reads columns of contacts, with the duration of an elastic collision where none is stated.
void ReadColumns(const v1::ContactColumns& columns, ContactIntake& intake) {
  absl::Status status = TryReadColumns(columns, intake);
  if (!status.ok()) intake.Reject(std::max<uint64_t>(1, CountContacts(columns)), std::move(status));
}

void ReadColumns(const v1::PoseColumns& columns, ContactIntake& intake) {
  if (absl::Status status = Validate(columns); !status.ok()) {
    const auto count = static_cast<uint64_t>(columns.object_size());
    return intake.Reject(std::max<uint64_t>(1, count), std::move(status));
  }
  for (int row = 0; row < columns.object_size(); ++row) {
    intake.Move(columns.object(row), ReadRow(columns, row),
                PlaceIn("poses", columns.object_size(), row));
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

void ReadRows(const v1::ContactColumns& columns, std::span<const int> rows,
              const HertzContact& hertz, ContactIntake& intake) {
  const auto row_of = [rows](int i) { return rows[static_cast<size_t>(i)]; };
  [[maybe_unused]] const absl::Status read =
      TryReadRows(columns, static_cast<int>(rows.size()), row_of, hertz, intake);
  assert(read.ok());
}

absl::Status ReadStep(const v1::ContactStep& step, ContactIntake& intake) {
  RETURN_IF_ERROR(intake.BeginStep(step.time_s(), step.has_time_scale() ? step.time_scale() : 1));
  ReadColumns(step.poses(), intake);
  if (step.has_listener()) intake.MoveListener(FromProto(step.listener()));
  ReadRows(step, intake);
  for (const v1::ContactColumns& columns : step.contact_columns()) ReadColumns(columns, intake);
  intake.EndStep();
  return absl::OkStatus();
}

}  // namespace carillon
