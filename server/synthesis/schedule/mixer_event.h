// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <type_traits>
#include <variant>

#include "server/base/octave_gains.h"
#include "server/synthesis/schedule/pulse.h"

namespace carillon {

/// Names a bank in a mixer; a default BankId names no bank.
struct BankId {
  uint32_t slot = UINT32_MAX;
  uint32_t generation = 0;
  friend bool operator==(const BankId&, const BankId&) = default;
};

/// A point on a triangle of the sounding surface.
struct TrianglePoint {
  std::array<uint32_t, 3> vertices{};
  std::array<float, 3> weights{};  ///< barycentric
};

/// An impulse at a point of the sounding surface.
struct SurfaceImpulse {
  TrianglePoint at{};
  std::array<float, 3> impulse_newton_seconds{};  ///< in the object's frame
  Pulse pulse{};
  OctaveGains gains{};  ///< of the modes by their damped frequencies
};

/// The start of an impulse's contact. The sound of the body's own acceleration begins at this time,
/// and the modes begin at the impulse's time.
struct ContactBegin {
  SurfaceImpulse impulse{};
};

/// The force of one sustained contact at a point of the sounding surface. The mixer adds it to the
/// object's whole force, which becomes effective at the object's next knot.
struct SurfaceForce {
  TrianglePoint at{};
  std::array<float, 3> force_newtons{};  ///< in the object's frame
};

/// The end of a simulation step: the forces added since the previous knot become the object's whole
/// force. Between two knots the force is interpolated linearly.
struct ForceKnot {
  float step_s = 0;        ///< time since the previous knot
  float roughness = 0;     ///< root mean square of the force's fluctuation, relative to the force
  float bandwidth_hz = 0;  ///< of the fluctuation; zero if the contact does not travel
};

/// A straight movement to a new place.
struct Motion {
  std::array<float, 3> position_m{};
  std::array<float, 3> right{1, 0, 0};  ///< a listener's unit vector to the right
  /// x, y and z of the unit quaternion (w is not negative) that rotates vectors from the body's
  /// frame into the scene's frame. Only binaural voices use the orientation of a listener.
  std::array<float, 3> orientation{};
  float glide_frames = 0;  ///< duration; below one, the motion is a jump
};

/// A movement of the object through whose voice the bank sounds.
struct ObjectMove {
  Motion motion{};
};

/// A movement of the listener who hears the bank's voice.
struct ListenerMove {
  Motion motion{};
};

/// One instruction to one bank, with its time: frame + fraction, in frames since the mixer began.
/// The first audible sample is the first sample at or after that time. The phase of the sound in it
/// accounts for the part of a frame between that time and the sample.
struct MixerEvent {
  using Action =
      std::variant<SurfaceImpulse, SurfaceForce, ForceKnot, ObjectMove, ListenerMove, ContactBegin>;

  BankId bank{};
  uint64_t frame = 0;
  float fraction = 0;  ///< 0 <= fraction < 1
  Action action{};
  uint32_t added_count = 0;  ///< further impulses whose sum with the first one is the impulse

  /// The event's time in frames.
  double Time() const noexcept { return static_cast<double>(frame) + double{fraction}; }

  /// Sets the event's time to `frames`, zero or more.
  void SetTime(double frames) noexcept {
    const double whole = std::floor(frames);
    frame = static_cast<uint64_t>(whole);
    // The cast may round 1 - 1e-9 up to 1.
    fraction = std::min(0x1.fffffep-1F, static_cast<float>(frames - whole));
  }

  /// Number of the first audible sample.
  uint64_t FirstSample() const noexcept { return frame + (fraction > 0 ? 1 : 0); }

  /// Frames from the event to its first audible sample.
  float LeadFrames() const noexcept { return fraction > 0 ? 1 - fraction : 0; }

  /// Number of reports of a client whose effect the event has.
  uint64_t ReportCount() const noexcept { return uint64_t{1} + added_count; }

  /// Returns the impulse, or null for another kind of event.
  const SurfaceImpulse* impulse() const noexcept { return std::get_if<SurfaceImpulse>(&action); }

  /// Returns the impulse of a contact that begins, or null for another kind of event.
  const SurfaceImpulse* beginning() const noexcept {
    const auto* begin = std::get_if<ContactBegin>(&action);
    return begin != nullptr ? &begin->impulse : nullptr;
  }
};

// Queues between threads copy events bytewise.
static_assert(std::is_trivially_copyable_v<MixerEvent>);
static_assert(sizeof(MixerEvent) == 80);

}  // namespace carillon
