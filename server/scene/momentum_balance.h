// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "server/base/pose.h"

namespace carillon {

/// A mistake in the impulses that an engine reports, which the motion of the bodies shows.
enum class EngineMistake {
  kForces,       ///< forces in place of impulses: too great by 1/step
  kTwice,        ///< each contact twice
  kStale,        ///< an old impulse again, though the body is gone
  kLastSubstep,  ///< the impulses of the last of several substeps alone
  kReversed,     ///< impulses on the other body
  kOtherFrame,   ///< impulses in another frame than the stated one
  kLate,         ///< impulses a step after they acted
  kFirstZero,    ///< no impulse in the step in which a contact begins
  kOtherMass,    ///< impulses on a body of another mass
};
inline constexpr size_t kEngineMistakeCount = 9;

/// The size of a mistake.
struct MistakeSize {
  uint64_t count =
      0;  ///< blows, or contacts or steps of bodies at rest; zero if there is no mistake
  /// Reported impulse over the true one, where the mistake has such a ratio.
  double ratio = 0;
  uint32_t handle = 0;  ///< of an object that shows it
};

using EngineMistakes = std::array<MistakeSize, kEngineMistakeCount>;

/// Compares the impulses that an engine reports with those that must have acted on the bodies by
/// Newton's law, from their poses x_k at the steps t_k:
///
///     V_k = (x_k - x_{k-1}) / (t_k - t_{k-1}),   m (V_k - V_{k-1} - g h) = J_k
///
/// The poses are those after the step, or those before it, as MuJoCo has them: then J_k belongs to
/// V_{k+1}. Gravity g is the usual acceleration of bodies without contacts.
///
/// A blow is judged in all: the leap of the momentum between times in which it does not leap, and
/// the sum of the impulses in these steps. So a contact that is spread over several steps counts as
/// one. A leap without any contact, such as that of a body that is moved by hand or by a joint, is
/// no blow. A mistake is reported only if most blows of the simulation show the same one. Bodies at
/// rest show the ratio of their load to their weight.
///
/// Bodies without poses are judged by what they cannot do: to carry 9.81 m/s^2 over the step in
/// each step, and by contacts that are equal. Two objects whose contacts come from both sides,
/// (a, b, J) and (b, a, -J), are judged by that alone.
class MomentumBalance {
 public:
  /// `step_s` is the simulator's step, seconds, and `scene_frame` whether the impulses were stated
  /// in the scene's frame.
  MomentumBalance(double step_s, bool scene_frame) : step_s_(step_s), scene_frame_(scene_frame) {}

  /// Tells the centre of mass of a body at the step, in the scene's frame, metres, and its
  /// orientation.
  void Move(uint32_t handle, const Vector3& centre_m, const Quaternion& orientation);

  /// What a body is in a contact: the only object, or the first or the second of two.
  enum class Role : uint8_t { kOnly, kFirst, kSecond };

  /// Tells an impulse that a body is said to get in the step.
  struct Report {
    uint32_t handle = 0;
    double mass_kg = 1;
    std::array<float, 3> impulse_newton_seconds{};  ///< in the body's frame
    /// The vertices and weights of the point on the surface.
    std::array<uint32_t, 3> vertices{};
    std::array<float, 3> weights{};
    Role role = Role::kOnly;
  };
  void Touch(const Report& report) { reports_.push_back(report); }

  /// Tells a contact of a body without an impulse.
  void TouchWithout(uint32_t handle) { empty_touches_.push_back(handle); }

  /// Ends the step at simulation time `time_s`.
  void EndStep(double time_s);

  /// The mistakes that are probable by now, by EngineMistake.
  EngineMistakes mistakes() const;

 private:
  /// A step of a body, as changes of its speed, m/s, in the scene's frame.
  struct Step {
    double step_s = 0;
    bool moved = false;    // whether `leap` is known
    bool touches = false;  // whether a contact is reported, even without an impulse
    bool repeats = false;  // whether the impulse is exactly that of the step before
    Vector3 velocity{};    // V_k
    Vector3 leap{};        // V_k - V_{k-1}
    Vector3 reported{};    // J_k / m
    Vector3
        reported_otherwise{};  // J_k / m if its frame is the object's and not the scene's, or so
  };
  static constexpr size_t kStepCount = 16;

  struct Body {
    std::optional<Vector3> centre_m;
    Quaternion orientation{};
    bool moves_now = false;   // whether the step has a pose
    bool is_of_step = false;  // whether the step has a pose or a contact
    uint64_t step_count = 0;  // of the balance, after the newest of `steps`
    int pose_count = 0;       // in a row
    Vector3 velocity{};
    bool flew = false;
    bool thrown = false;        // away from its partner, without an impulse
    int stale_run = 0;          // steps
    std::vector<Step> steps{};  // the newest last, at least the last kStepCount
    int leap_steps = 0;         // of a leap that is not over
    int calm_steps = 0;         // after it
    // A load.
    uint64_t rest_count = 0;
    double rest_s = 0;
    Vector3 rest_reported{};
    // The ratios of the blows whose direction is right, and other verdicts.
    std::vector<double> ratios{};
    uint64_t right_count = 0, lost_count = 0, stale_count = 0;
  };

  Body& BodyOfStep(uint32_t handle);
  void AddStep(Body& body, double time_s);
  void EndStep(Body& body, uint32_t handle);
  void NoteFlight(Body& body);
  void NoteRest(Body& body);
  void NoteStale(Body& body);
  void NoteLeap(Body& body, uint32_t handle);
  /// A blow, as the steps first..last of a body.
  struct Leap {
    const std::vector<Step>& steps;
    size_t first = 0, last = 0;
    double size = 0;    // m/s, gravity not counted
    double weight = 0;  // the speed that gravity gives in a step, m/s
  };
  /// How well impulses explain a blow.
  struct Fit {
    double ratio = 0;        // of the impulses to those that explain most
    double unexplained = 1;  // the part of the square of the leaps that these do not explain
  };
  /// Fits the impulses of the steps `delay_steps` later to the blow.
  Fit FitTo(const Leap& leap, int delay_steps, Vector3 Step::*reported) const;
  void NoteRight(Body& body);
  /// Returns whether the impulses explain a blow but for its first step, which has none.
  bool IsFirstZero(const Leap& leap) const;
  static bool IsToldInAll(const Leap& leap, const Vector3& sum);
  void Judge(Body& body, uint32_t handle, size_t first, size_t last);
  void CountEqual();
  double Gravity() const;
  void Add(EngineMistake mistake, uint32_t handle);
  std::optional<double> RatioOfBlows(const Body& body) const;
  double RatioOfRest(const Body& body) const;
  std::optional<EngineMistake> ShownByRest(const Body& body) const;
  void AddRatios(EngineMistakes& found) const;

  const double step_s_;
  const bool scene_frame_;
  std::map<uint32_t, Body> bodies_;
  std::vector<std::pair<uint32_t, Body*>> of_step_;  // the bodies that move or touch in the step
  uint64_t step_count_ = 0;
  std::vector<Report> reports_;          // of the step
  std::vector<uint32_t> empty_touches_;  // of the step
  std::vector<Vector3> flights_;         // accelerations of bodies without contact, m/s^2
  Vector3 gravity_{};                    // their median
  bool has_gravity_ = false;
  uint64_t touch_count_ = 0, equal_count_ = 0;
  uint64_t pair_touch_count_ = 0, mirrored_count_ = 0;  // both count contacts of two objects
  uint64_t right_count_ = 0, judged_count_ = 0;         // blows
  EngineMistakes counted_{};
  std::optional<double> time_s_;
};

}  // namespace carillon
