// SPDX-License-Identifier: Apache-2.0
#include "server/api/convert/perform_rows.h"

#include <algorithm>
#include <compare>

#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/api/convert/contact_conversion.h"
#include "server/api/convert/contact_fields.h"
#include "server/api/convert/hertz_contact_conversion.h"

namespace carillon {
namespace {

absl::Status Invalid(absl::string_view reason, absl::string_view message) {
  return Refusal(absl::StatusCode::kInvalidArgument, reason, message);
}

/// Orders the contacts of a list by their content.
class ByContent {
 public:
  explicit ByContent(const v1::ContactColumns& columns) : columns_(columns) {}

  bool operator()(int a, int b) const {
    for (const auto* column :
         {&columns_.object(), &columns_.partner(), &columns_.second_object()}) {
      if (const auto order = Compare(*column, 1, a, b); order != 0) return order < 0;
    }
    const auto& vectors = columns_.force_newtons_size() > 0 ? columns_.force_newtons()
                                                            : columns_.impulse_newton_seconds();
    if (const auto order = Compare(columns_.time_offset_s(), 1, a, b); order != 0) return order < 0;
    if (const auto order = Compare(columns_.duration_s(), 1, a, b); order != 0) return order < 0;
    if (const auto order = Compare(columns_.point_m(), 3, a, b); order != 0) return order < 0;
    if (const auto order = Compare(columns_.normal(), 3, a, b); order != 0) return order < 0;
    return Compare(vectors, 3, a, b) < 0;
  }

 private:
  template <typename Column>
  static std::partial_ordering Compare(const Column& column, int width, int a, int b) {
    if (column.empty()) return std::partial_ordering::equivalent;
    const auto* const data = column.data();
    return std::lexicographical_compare_three_way(
        data + a * width, data + (a + 1) * width, data + b * width, data + (b + 1) * width,
        [](auto x, auto y) -> std::partial_ordering { return x <=> y; });
  }

  const v1::ContactColumns& columns_;
};

std::span<const uint32_t> SpanOf(const google::protobuf::RepeatedField<uint32_t>& column) {
  return {column.data(), static_cast<size_t>(column.size())};
}

absl::Status Validate(const v1::MicrophonePoses& poses) {
  const int count = poses.microphone_size();
  const bool rotated = poses.orientation_size() > 0;
  if (poses.position_m_size() == 3 * count && (!rotated || poses.orientation_size() == 4 * count)) {
    return absl::OkStatus();
  }
  return Invalid(
      "CONTACT_MALFORMED",
      absl::StrCat("microphone_poses has ", count, " microphones, ", poses.position_m_size(),
                   " coordinates and ", poses.orientation_size(),
                   " numbers of orientations; give 3 and 4, or no orientation, for "
                   "each microphone"));
}

/// Returns the figures of the collisions of a list. Errors: InvalidArgument (CONTACT_MALFORMED,
/// UNKNOWN_STRIKER).
absl::StatusOr<HertzContact> Check(const v1::ContactColumns& columns) {
  RETURN_IF_ERROR(KindOf(columns.kind()).status());
  RETURN_IF_ERROR(carillon::Validate(columns));
  return ToHertzContact(columns.hertz());
}

Pose ReadPose(const v1::MicrophonePoses& poses, int row) {
  Pose pose{.position_m = {poses.position_m(3 * row), poses.position_m(3 * row + 1),
                           poses.position_m(3 * row + 2)}};
  if (poses.orientation_size() > 0) {
    pose.orientation = {poses.orientation(4 * row), poses.orientation(4 * row + 1),
                        poses.orientation(4 * row + 2), poses.orientation(4 * row + 3)};
  }
  return pose;
}

}  // namespace

void StepRejections::Tell(size_t environment, ContactIntake& intake) const {
  const auto [begin, end] = of_environments_.equal_range(environment);
  for (auto at = begin; at != end; ++at) intake.Reject(at->second.count, at->second.why);
}

absl::Status StepRejections::status() const {
  if (!strays_.empty()) return strays_.front().why;
  return of_environments_.empty() ? absl::OkStatus() : of_environments_.begin()->second.why;
}

RowsByEnvironment::RowsByEnvironment(std::span<const uint32_t> environments, int row_count,
                                     size_t environment_count, StepRejections& rejections)
    : first_(environment_count + 1) {
  const auto count = static_cast<size_t>(row_count);
  if (!environments.empty() && environments.size() != count) {
    rejections.AddStray(
        std::max<size_t>(count, 1),
        Invalid("CONTACT_MALFORMED",
                absl::StrCat("environment has ", environments.size(), " numbers for ", count,
                             " rows; give one for each row, or none")));
    return;
  }
  const auto environment_of = [&](size_t row) {
    return environments.empty() ? 0 : environments[row];
  };
  size_t unknown_count = 0, last_unknown = 0;
  for (size_t row = 0; row < count; ++row) {
    if (environment_of(row) < environment_count) {
      ++first_[environment_of(row) + 1];
    } else {
      ++unknown_count;
      last_unknown = row;
    }
  }
  if (unknown_count > 0) {
    rejections.AddStray(unknown_count,
                        Invalid("PERFORMANCE_MALFORMED",
                                absl::StrCat("row ", last_unknown, " is of environment ",
                                             environment_of(last_unknown), "; the performance has ",
                                             environment_count, ", counted from 0")));
  }
  for (size_t i = 0; i < environment_count; ++i) first_[i + 1] += first_[i];
  rows_.resize(first_.back());
  std::vector<size_t> next(first_.begin(), first_.end() - 1);
  for (size_t row = 0; row < count; ++row) {
    if (environment_of(row) >= environment_count) continue;
    rows_[next[environment_of(row)]++] = static_cast<int>(row);
  }
}

void RowsByEnvironment::Reject(const absl::Status& why, StepRejections& rejections) {
  if (rows_.empty()) rejections.AddStray(1, why);
  for (size_t i = 0; i + 1 < first_.size(); ++i) {
    if (const size_t count = of(i).size(); count > 0) rejections.Add(i, count, why);
  }
  rows_.clear();
  std::ranges::fill(first_, 0);
}

PerformRows::PerformRows(const v1::PerformStep& step, const Performance& performance,
                         StepRejections& rejections)
    : step_(step),
      most_events_(performance.settings().most_events()),
      rejections_(rejections),
      poses_(SpanOf(step.poses().environment()), step.poses().columns().object_size(),
             performance.environment_count(), rejections),
      microphones_(SpanOf(step.microphone_poses().environment()),
                   step.microphone_poses().microphone_size(), performance.environment_count(),
                   rejections) {
  const size_t environment_count = performance.environment_count();
  const size_t microphone_count = performance.settings().microphones.size();
  const absl::Status poses = carillon::Validate(step.poses().columns());
  if (!poses.ok()) poses_.Reject(poses, rejections);
  const absl::Status microphones = Validate(step.microphone_poses());
  if (!microphones.ok()) microphones_.Reject(microphones, rejections);
  for (size_t i = 0; i < environment_count; ++i) {
    for (const int row : microphones_.of(i)) {
      const uint32_t microphone = step.microphone_poses().microphone(row);
      if (microphone < microphone_count) continue;
      rejections.Add(
          i, 1,
          Invalid("PERFORMANCE_MALFORMED",
                  absl::StrCat("microphone_poses has microphone ", microphone,
                               "; the settings have ", microphone_count, ", counted from 0")));
    }
  }
  for (const v1::PerformedContacts& contacts : step.contacts()) {
    const v1::ContactColumns& columns = contacts.columns();
    RowsByEnvironment own(SpanOf(contacts.environment()), columns.object_size(), environment_count,
                          rejections);
    const absl::StatusOr<HertzContact> hertz = Check(columns);
    if (!hertz.ok()) {
      own.Reject(hertz.status(), rejections);
      continue;
    }
    own.Order(ByContent(columns));
    contacts_.push_back({&columns, *hertz, std::move(own)});
  }
}

void PerformRows::Read(size_t environment, size_t microphone, ContactIntake& intake) const {
  if (microphone == 0) rejections_.Tell(environment, intake);
  for (const int row : poses_.of(environment)) {
    const v1::PoseColumns& columns = step_.poses().columns();
    intake.Move(columns.object(row), ReadRow(columns, row),
                {.list = "poses", .index = static_cast<uint32_t>(row)});
  }
  for (const int row : microphones_.of(environment)) {
    const v1::MicrophonePoses& poses = step_.microphone_poses();
    if (poses.microphone(row) == microphone) intake.MoveListener(ReadPose(poses, row));
  }
  size_t room = most_events_;
  for (const Contacts& contacts : contacts_) {
    const std::span<const int> rows = contacts.rows.of(environment);
    const size_t events_per_row = contacts.columns->second_object().empty() ? 1 : 2;
    const size_t taken_count = std::min(rows.size(), room / events_per_row);
    ReadRows(*contacts.columns, rows.first(taken_count), contacts.hertz, intake);
    room -= events_per_row * taken_count;
    if (taken_count == rows.size()) continue;
    intake.Reject(rows.size() - taken_count,
                  Refusal(absl::StatusCode::kResourceExhausted, "TOO_MANY_CONTACTS",
                          absl::StrCat("an environment takes ", most_events_,
                                       " contacts in a step, of which those with a second object "
                                       "count twice; report fewer points")));
  }
}

}  // namespace carillon
