// SPDX-License-Identifier: Apache-2.0
#include "server/scene/step_impulses.h"

#include <limits>
#include <optional>
#include <variant>

#include "absl/hash/hash.h"

namespace carillon {
namespace {

/// Returns the key of an impulse that may be added to another one, or nothing.
std::optional<StepImpulses::Key> KeyOf(const ObjectImpulse& impulse) {
  const ContactImpulse& contact = impulse.contact.impulse;
  const auto* point = std::get_if<Point>(&contact.location);
  if (point == nullptr || impulse.contact.second || !contact.duration_s) return std::nullopt;
  return StepImpulses::Key{.handle = impulse.contact.handle,
                           .time_offset_s = impulse.time_offset_s,
                           .duration_s = *contact.duration_s,
                           .point = *point};
}

/// Keys with equal hashes may differ in time or duration.
size_t HashOf(const StepImpulses::Key& key) {
  return absl::HashOf(key.handle, key.point[0], key.point[1], key.point[2]);
}

}  // namespace

void StepImpulses::Struck::Add(const Vector3& impulse_newton_seconds) {
  auto& vector = std::get<SurfaceImpulse>(on_body.event.action).impulse_newton_seconds;
  for (size_t axis = 0; axis < vector.size(); ++axis) {
    sum_newton_seconds[axis] += impulse_newton_seconds[axis];
    vector[axis] = static_cast<float>(sum_newton_seconds[axis]);
  }
  ++on_body.event.added_count;
}

StepImpulses::Struck* StepImpulses::Find(const ObjectImpulse& impulse) {
  const std::optional<Key> key = KeyOf(impulse);
  if (!key) return nullptr;
  const uint16_t index = table_[HashOf(*key) % kTableSize];
  return index != kNone && struck_[index].key == *key ? &struck_[index] : nullptr;
}

void StepImpulses::Append(const ObjectImpulse& impulse, const BodyImpulse& on_body, double frame) {
  Struck& struck = struck_.emplace_back(Struck{.on_body = on_body, .frame = frame});
  const std::optional<Key> key = KeyOf(impulse);
  if (!key) return;
  struck.key = *key;
  struck.sum_newton_seconds = impulse.contact.impulse.impulse_newton_seconds;
  table_[HashOf(*key) % kTableSize] = static_cast<uint16_t>(struck_.size() - 1);
}

void StepImpulses::Clear() {
  struck_.clear();
  table_.fill(kNone);
}

}  // namespace carillon
