// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "carillon/v1/performance.pb.h"
#include "server/excitation/contact.h"
#include "server/scene/contact_intake.h"
#include "server/scene/offline/performance.h"

namespace carillon {

/// The parts of a step that could not be done, by environment.
class StepRejections {
 public:
  struct Rejection {
    uint64_t count = 0;  ///< of contacts, poses and changes of objects
    absl::Status why;
  };

  void Add(size_t environment, uint64_t count, absl::Status why) {
    of_environments_.emplace(environment, Rejection{count, std::move(why)});
  }
  /// Adds what names no environment of the performance.
  void AddStray(uint64_t count, absl::Status why) { strays_.push_back({count, std::move(why)}); }
  void Clear() {
    of_environments_.clear();
    strays_.clear();
  }

  /// Counts the rejected parts of an environment in the environment's intake.
  void Tell(size_t environment, ContactIntake& intake) const;
  std::span<const Rejection> strays() const { return strays_; }
  /// Returns why something was rejected, or OK if nothing was.
  absl::Status status() const;

 private:
  std::multimap<size_t, Rejection> of_environments_;
  std::vector<Rejection> strays_;
};

/// The rows of a list, sorted by environment.
class RowsByEnvironment {
 public:
  /// `environments` has the environment of each of `row_count` rows. If it is empty, all rows are
  /// in environment 0. Rows of no environment are rejected (CONTACT_MALFORMED,
  /// PERFORMANCE_MALFORMED). The rows of one environment keep their order.
  RowsByEnvironment(std::span<const uint32_t> environments, int row_count, size_t environment_count,
                    StepRejections& rejections);

  /// Orders the rows of each environment by `before(a, b)`.
  template <typename Before>
  void Order(const Before& before) {
    for (size_t i = 0; i + 1 < first_.size(); ++i) {
      const std::span<int> own = std::span(rows_).subspan(first_[i], first_[i + 1] - first_[i]);
      if (!std::ranges::is_sorted(own, before)) std::ranges::stable_sort(own, before);
    }
  }

  /// Rejects all rows, and forgets them.
  void Reject(const absl::Status& why, StepRejections& rejections);

  std::span<const int> of(size_t environment) const {
    return std::span(rows_).subspan(first_[environment],
                                    first_[environment + 1] - first_[environment]);
  }

 private:
  std::vector<int> rows_;
  std::vector<size_t> first_;  // index in rows_ of each environment's first row
};

/// The contacts and poses of a step of a performance, by environment.
class PerformRows {
 public:
  /// Rejects what cannot be read (CONTACT_MALFORMED, PERFORMANCE_MALFORMED, UNKNOWN_STRIKER), of a
  /// list with a wrong column or striker all rows. `step` and `rejections` must outlive the rows.
  PerformRows(const v1::PerformStep& step, const Performance& performance,
              StepRejections& rejections);

  /// Gives the poses and contacts of an environment to the intake of a microphone, and to that of
  /// the first one the rejections. Contacts come in an order that depends on their content alone,
  /// so that their order in the message does not change the sound. Safe from every thread.
  void Read(size_t environment, size_t microphone, ContactIntake& intake) const;

 private:
  struct Contacts {
    const v1::ContactColumns* columns;
    HertzContact hertz;
    RowsByEnvironment rows;
  };

  const v1::PerformStep& step_;
  const size_t most_events_;  // that an environment takes in a step
  const StepRejections& rejections_;
  RowsByEnvironment poses_;
  RowsByEnvironment microphones_;
  std::vector<Contacts> contacts_;
};

}  // namespace carillon
