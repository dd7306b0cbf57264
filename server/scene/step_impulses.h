// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/body_impulses.h"
#include "server/scene/object_contact.h"

namespace carillon {

/// The located impulses of a simulation step, until the step ends. Impulses that strike an object
/// at the same point and time, and last equally long, become one event with the sum of their
/// vectors. That event sounds as they would one by one, because the sound is linear in the impulse,
/// but it takes one place in the mixer's queues instead of many.
class StepImpulses {
 public:
  /// The properties that the impulses of one event have in common.
  struct Key {
    uint32_t handle = 0;
    double time_offset_s = 0;
    double duration_s = 0;
    Point point{};
    friend bool operator==(const Key&, const Key&) = default;
  };

  /// An event of the step, with the number of its frame.
  struct Struck {
    BodyImpulse on_body{};
    double frame = 0;
    Key key{};
    Vector3 sum_newton_seconds{};  ///< in double precision, so that many small impulses count

    /// Adds the vector of one more impulse.
    void Add(const Vector3& impulse_newton_seconds);
  };

  StepImpulses() { table_.fill(kNone); }

  /// Returns the event to which `impulse` may be added, or null. Only an impulse on one object, at
  /// a point in space and with a stated duration, is ever added to another one.
  Struck* Find(const ObjectImpulse& impulse);

  /// Appends the event of `impulse` on one of its objects.
  void Append(const ObjectImpulse& impulse, const BodyImpulse& on_body, double frame);

  /// Returns whether the events of this many impulses may be appended before Clear is called.
  bool HasRoom(size_t impulse_count) const {
    return struck_.size() + kMostObjects * impulse_count <= kMostEvents;
  }

  std::span<Struck> events() { return struck_; }
  void Clear();

 private:
  static constexpr size_t kMostEvents = 4096;
  static constexpr size_t kMostObjects = 2;  // one impulse strikes at most two objects
  // An event whose place in the table is taken by a later one is not found again.
  static constexpr size_t kTableSize = 256;
  static constexpr uint16_t kNone = UINT16_MAX;

  std::vector<Struck> struck_;
  std::array<uint16_t, kTableSize> table_{};  // indices of events by the hashes of their keys
};

}  // namespace carillon
