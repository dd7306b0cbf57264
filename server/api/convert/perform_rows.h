// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "carillon/v1/performance.pb.h"
#include "server/excitation/contact.h"
#include "server/scene/contact_intake.h"

namespace carillon {

/// The rows of a list, sorted by environment.
class RowsByEnvironment {
 public:
  /// `environments` has the environment of each of `row_count` rows. If it is empty, all rows are
  /// in environment 0. `before(a, b)` orders the rows of one environment. Errors: InvalidArgument
  /// (CONTACT_MALFORMED, PERFORMANCE_MALFORMED).
  template <typename Before>
  static absl::StatusOr<RowsByEnvironment> Make(std::span<const uint32_t> environments,
                                                int row_count, size_t environment_count,
                                                const Before& before) {
    RowsByEnvironment rows(row_count, environment_count);
    absl::Status status = rows.Sort(environments, environment_count);
    if (!status.ok()) return status;
    for (size_t i = 0; i < environment_count; ++i) {
      const std::span<int> own = rows.RowsOf(i);
      if (!std::ranges::is_sorted(own, before)) std::ranges::stable_sort(own, before);
    }
    return rows;
  }

  std::span<const int> of(size_t environment) const {
    return std::span(rows_).subspan(first_[environment],
                                    first_[environment + 1] - first_[environment]);
  }

 private:
  RowsByEnvironment(int row_count, size_t environment_count)
      : rows_(static_cast<size_t>(row_count)), first_(environment_count + 1) {}
  absl::Status Sort(std::span<const uint32_t> environments, size_t environment_count);
  std::span<int> RowsOf(size_t environment) {
    return std::span(rows_).subspan(first_[environment],
                                    first_[environment + 1] - first_[environment]);
  }

  std::vector<int> rows_;
  std::vector<size_t> first_;  // index in rows_ of each environment's first row
};

/// The contacts and poses of a step of a performance, by environment.
class PerformRows {
 public:
  /// `step` must outlive the rows. Errors: InvalidArgument (CONTACT_MALFORMED,
  /// PERFORMANCE_MALFORMED, UNKNOWN_STRIKER).
  static absl::StatusOr<PerformRows> Make(const v1::PerformStep& step, size_t environment_count,
                                          size_t microphone_count);

  /// Gives the poses and contacts of an environment to the intake of a microphone. Contacts come in
  /// an order that depends on their content alone, so that their order in the message does not
  /// change the sound. Safe from every thread.
  void Read(size_t environment, size_t microphone, ContactIntake& intake) const;

 private:
  struct Contacts {
    const v1::ContactColumns* columns;
    HertzContact hertz;
    RowsByEnvironment rows;
  };

  PerformRows(const v1::PerformStep& step, RowsByEnvironment poses, RowsByEnvironment microphones)
      : step_(step), poses_(std::move(poses)), microphones_(std::move(microphones)) {}

  const v1::PerformStep& step_;
  RowsByEnvironment poses_;
  RowsByEnvironment microphones_;
  std::vector<Contacts> contacts_;
};

}  // namespace carillon
