// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "server/excitation/contact.h"
#include "server/excitation/load_tracker.h"
#include "server/scene/body_impulses.h"
#include "server/scene/object_contact.h"
#include "server/scene/recent_poses.h"
#include "server/scene/step_intervals.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// The numbers of an engine's contacts that turned out to be blows and loads.
struct BlowCounts {
  uint64_t blow_count = 0;  ///< blows; a blow may span several steps
  uint64_t load_count = 0;  ///< contacts that were only loads, counted in each step
};

/// An action on an object at a simulation time.
struct ForceEvent {
  uint32_t handle = 0;
  uint64_t serial = 0;  ///< the serial of the object, see Scene::Insert
  MixerEvent::Action action{};
  double time_s = 0;
  Collision collision{};   ///< of a blow
  uint32_t by = 0;         ///< the other body of a blow
  bool by_sounds = false;  ///< whether `by`, in a blow, is the handle of an object
};

/// Decides which of a simulation's engine contacts are blows and which are loads, and turns both,
/// and the sustained forces, into events of the mixer. For each object under a force, each step
/// produces the object's forces and then a knot. Each blow that is over produces an impulse. Only
/// one thread at a time may use it.
///
/// Engines with soft contacts spread a blow over several steps. As long as no step is missing, the
/// steps of a blow are gathered into one impulse, which is sent at the step in which the blow turns
/// out to be over:
///
///     force   |      . .                the blow is over when
///             |    .     .              * the force above the load has fallen to a quarter of its
///             |   .       .               greatest value, or
///             |  .         |            * it is below half of that, and steady for 10 ms, or
///      load   |............|......      * 0.1 s and eight steps have passed.
///             +------------+------ t    In the last two cases the force that remains is a load,
///             begin        over         and counts for nothing in the blow.
///
/// From 40 ms on, the force of such a blow is sent as a force, too, because a body that is put down
/// and slides must be heard. If the contact does not slide, the force is below the body's modes and
/// silent.
///
/// A blow may strike several places: a box that lands rocks from corner to corner. Contacts of
/// following steps are at one place if they lie within an eighth of the smaller body's extent, in
/// the frame of either body. Each place gets the impulse of its own contacts. Places whose
/// impulses are greatest in one step strike together, and those of a later step as much later. A
/// strong impulse at a place that the last blow did not touch is no part of that blow's end, and
/// the force of that blow does not count as its load. Nor does it count for the next blow at the
/// same place if the bodies met without a load and parted again.
///
/// A client may send only the steps with contacts. Steps that are missing count as steps without
/// contact, and the first step after a gap is a blow by itself, which need not wait for more steps.
/// A game that stutters takes one long step instead. If a pair rested before a gap of up to half a
/// second, an impulse that fits its load for the length of the gap is therefore still its load. The
/// impulse of a body that was thrown up and lands would fit, too. Hence the client must have sent
/// empty steps before, so that it leaves none out, or several pairs must have rested and touch.
///
/// An impulse that changes the speed of its bodies by hardly more than gravity does in a step may
/// be the load of a body that rests when the simulation begins, or whose contact flickers. In the
/// first steps of a simulation, or shortly after the last contact, such a feeble blow is not over
/// before its contact has been lost for some steps, and is a load if the contact returns before
/// that; an impulse with which it returns that is not feeble is a blow of its own. Others, after a
/// flight, need not wait.
///
/// The contacts of a pair that strike in one step share the impact: where a face lands flat, all of
/// its corners meet the floor at the same speed, and each brings a part of the mass to rest. All
/// get the duration of a contact with that part, the mean of the places' parts of the impulse
/// weighted by these, of the mass that all impulses meet together. Contacts at one place count as
/// one. The speed is that at which the places approached before the blow, if poses tell it and the
/// impulse fits it, and otherwise that of an elastic collision.
///
/// A body that slides from one partner to the next, such as over the tiles of a floor, takes its
/// load along. If a pair begins to touch in the step in which another pair of the same body
/// ceases to, with a force in the same direction and no more than three times as great, the new
/// pair continues the old one.
///
/// An engine reports the step of a blow, not the time within the step. Blows of two bodies that
/// slide, roll or hop would therefore sound on the grid of the steps, as tones at multiples of the
/// step rate. A blow of two bodies that touched within 0.1 s before it is sent at a random time
/// within one step after the step in which it is over. The time is uniformly distributed, so that
/// the mean spectrum of such blows has no lines. The time is a function of the simulation time and
/// of the two bodies, so that the same simulation gives the same events. The first blow after a
/// flight, the next one if it is at another place, and contacts with a time offset of their own
/// have exact times.
class BlowGatherer {
 public:
  /// Events, valid until the next call of a function that returns events.
  using Events = std::span<const ForceEvent>;

  /// `step_s` is the simulator's step, seconds.
  explicit BlowGatherer(double step_s) : nominal_step_s_(step_s) {}

  /// Begins the step at simulation time `time_s`, which must not be before the last step's. If
  /// steps were left out, the forces ended with the last step. Returns the events that end these
  /// forces.
  Events Begin(double time_s);

  /// Sets the pose of an object, which has this serial, in this step.
  void Move(uint32_t handle, uint64_t serial, const Pose& pose) {
    poses_.Move(handle, serial, pose);
  }

  /// Adds a force to this step. The impulses in `force` are newtons, not newton seconds.
  void Add(const BodyImpulses& force, const Roughness& roughness);

  /// The greatest number of contacts of a step, and of pairs of bodies whose contacts are followed.
  /// A pair and its contact take about 900 bytes.
  static constexpr size_t kMostTouches = 16'384;

  /// Returns whether Touch may be called with this contact.
  bool HasRoom(const ObjectTouch& touch) const;

  /// Adds a contact that may be a blow or a load to this step. `impulse` has the impulses of the
  /// contact on its objects; they must not be zero.
  void Touch(const ObjectTouch& touch, const BodyImpulses& impulse);

  /// Ends the step and returns its events.
  Events End();

  /// Ends the simulation. Returns the blows that are not over yet.
  Events Finish();

  BlowCounts counts() const { return counts_; }

 private:
  using Bodies = std::pair<uint32_t, uint32_t>;  // handle of the object, number of the partner

  /// The force on an object in this step.
  struct Force {
    uint32_t handle = 0;
    uint64_t serial = 0;
    SurfaceForce force;
    Roughness roughness;
  };
  /// An object under a force in this step or shortly before.
  struct Object {
    uint32_t handle = 0;
    uint64_t serial = 0;
    int steps_without = 0;
  };
  /// The impulse of a contact on one of its objects.
  struct Part {
    uint32_t handle = 0;
    double mass_kg = 1;  // of the object
    uint64_t serial = 0;
    SurfaceImpulse impulse;
    Vector3 point_m{};   // in the object's frame
    Vector3 pressing{};  // as in BodyImpulse
    Vector3 turn{};      // as in BodyImpulse
    Collision collision{};
  };
  struct PairTouch {
    Bodies bodies;
    std::array<Part, 2> parts{};
    size_t part_count = 0;
    double magnitude = 0;  // of the first object's impulse, N s
    double pressing = 0;   // magnitude of the impulse's part along the normal, N s
    double reach_m = 0;    // how far apart contacts at one place may be
    Roughness roughness;
    double time_offset_s = 0;
    bool duration_follows_impulse = false;
    bool mass_is_stated = false;
    std::optional<double> striker_per_kg = 0;  // as in BodyImpulses

    std::span<const Part> all() const { return std::span(parts).first(part_count); }
  };
  /// What a touch has of its impact.
  struct BlowShares {
    double scale = 1;          ///< as in Strike
    double of_blow = 1;        ///< the part of the touch in the impact's impulse
    double of_mass = 1;        ///< the part of the mass that a place brings to rest, by its impulse
    double mass_kg = 0;        ///< as in Collision, of the whole impact
    double speed_m_per_s = 0;  ///< approach speed, or zero: J/(2 m)
  };
  static ForceEvent PartOfBlow(const PairTouch& touch, size_t which, const BlowShares& shares);
  /// Returns the vertex nearest to a touch. Touches of an impact with the same one are one contact.
  static uint32_t VertexOf(const PairTouch& touch);
  /// The sum of impulses on an object, N s, in the object's frame.
  struct Motion {
    uint32_t handle = 0;
    double mass_kg = 0;  // zero: there is no such object
    std::array<double, 3> impulse{};
  };
  /// A place that a blow strikes.
  struct Place {
    std::vector<double> impulses{};    // above the load in each step of the blow, N s
    size_t strongest = 0;              // index of the step with the greatest impulse
    std::vector<PairTouch> touches{};  // touches of that step
    PairTouch latest{};                // one of the latest step
    double approach_m_per_s = 0;       // when it began; zero if unknown

    double impulse_in(size_t step) const { return step < impulses.size() ? impulses[step] : 0; }
    double greatest() const { return impulse_in(strongest); }
  };
  /// The steps of a blow that is not over yet, or none.
  struct Blow {
    struct Step {
      double impulse = 0;  // above the load, N s
      double force = 0;    // the whole force, newtons
      double time_s = 0;
      double step_s = 0;  // length of the step
    };
    double load_newtons = 0;      // load before the blow
    double greatest_newtons = 0;  // the greatest force above the load
    std::vector<Step> steps{};
    std::vector<Place> places{};  // in the order in which they began
    bool lasting = false;         // whether the bodies touched here shortly before the blow
    bool feeble = false;          // whether its first step may have been a load
    bool only_feeble = true;      // whether all of its steps may have been a load
    int lost_steps = 0;           // steps since a feeble blow lost its contact

    bool begun() const { return !steps.empty(); }
    double begin_s() const { return steps.front().time_s; }
  };
  /// A touch of a blow, with what all steps gave its place.
  struct Strike {
    const PairTouch* touch = nullptr;
    double scale = 1;  // impulse that the blow gives the touch, over the touch's own

    double impulse() const { return scale * touch->magnitude; }
  };
  /// Places of a blow that strike together.
  struct Impact {
    size_t step = 0;  // index in the blow's
    double approach_m_per_s = 0;
    std::vector<Strike> strikes{};
  };
  /// Divides the places of a blow, with this share of their impulses, into impacts in order of
  /// their steps.
  static std::vector<Impact> ImpactsOf(const Blow& blow, double share);
  static bool IsAtOnePlace(const PairTouch& one, const PairTouch& other);
  /// Returns the mass and the speed of the collision that an impact is.
  static Collision CollisionOf(const Impact& impact);
  struct Pair {
    Bodies bodies;
    LoadTracker load{};
    std::span<const PairTouch> touches{};            // of this step, in touches_
    std::optional<double> touched_s = std::nullopt;  // the time of the last touch before this step
    std::array<Motion, 2> given{};                   // what it gave its objects in the last touch
    LoadTracker before_gap{};                        // the load when the steps ceased
    // The end of its last blow, if it had no load before and none remained.
    std::optional<double> flew_until_s = std::nullopt;
    // The times at which the last two blows began.
    std::optional<double> last_blow_s = std::nullopt, blow_before_last_s = std::nullopt;
    Blow blow{};
  };

  void EndStep();
  /// Makes the pairs that touch for the first time, and gives each pair its touches of this step.
  void PairTouches();
  /// Lets pairs that begin to touch continue those of the same objects that cease to.
  void FollowPartners();
  static bool Continues(const Pair& before, const Pair& now);
  static std::array<Motion, 2> GivenBy(std::span<const PairTouch> touches);
  /// Returns whether this step changes the speed of no object of the pair by much more than gravity
  /// does.
  bool IsFeeble(const Pair& pair);
  /// Returns whether the pair touched shortly before, or may have done so before the simulation.
  bool MayFlicker(const Pair& pair) const;
  /// Fills in motions_ for this step.
  void AddUpMotions();
  int MostLostSteps() const;
  /// Returns whether the step, which follows no other, may be one of a simulation without gaps.
  bool MayFollow() const;
  /// Ends the forces, and lets `missing_count` steps without contact pass.
  void EndBeforeGap(double missing_count);
  /// Adds a force to this step: the impulse of `part`, N s, times `per_second`, 1/s.
  void Add(const Part& part, double per_second, const Roughness& roughness);
  /// Sends the forces of this step, and each object's knot.
  void SendForces();
  /// Returns whether this step, which follows no other, is a long one of a game that stutters.
  bool Stutters() const;
  /// Returns whether a pair rested in the long step of a stutter. If so, its load goes on.
  bool ContinuesAfterGap(Pair& pair);
  static double ImpulseOf(const Pair& pair);
  /// Sends the blows of two bodies as impulses, and their loads (see LoadTracker) as forces.
  void Divide(Pair& pair);
  /// Adds a step's force to the time for which a feeble blow has lost its contact. Returns whether
  /// the contact returns before the blow is over, so that there was no blow.
  bool Flickers(Blow& blow, double force_newtons);
  /// Adds the touches of this step, whose impulses times `per_second` are forces, and forgets them.
  void EndTouches(Pair& pair, double per_second);
  /// Ends a pair's blow if the force of this step leaps far above the forces that were gathered.
  /// These were a load, such as that of a body that was just laid down, or a blow of their own.
  void EndBeforeLeap(Pair& pair, double force_newtons);
  /// Ends what turned out to be a load.
  void CountAsLoad(Blow& blow);
  /// Returns the mean of the speeds at which the places of the touches approach, weighted by their
  /// impulses, or zero if it is not known.
  double ApproachSpeed(std::span<const PairTouch> touches) const;
  /// Adds a step's force, of which `above_newtons` are above the load, to the pair's blow, which
  /// begins with its first step.
  void Gather(Pair& pair, double force_newtons, double above_newtons);
  /// Adds a step's touches to the places of a blow, each with this share of its impulse.
  void AddToPlaces(Blow& blow, std::span<const PairTouch> touches, double share) const;
  /// Returns whether the blow is over in this step, which has the given force, of which
  /// `above_newtons` are above the load, and may strike `elsewhere`. If a load remains, `remains`
  /// is set to its force.
  bool IsOver(const Blow& blow, double force_newtons, double above_newtons, bool elsewhere,
              double& remains) const;
  /// Returns whether a blow has lasted as long as one may: what touches then is a load.
  bool HasLasted(const Blow& blow) const;
  static double MeanForceOfLastHalf(const Blow& blow);
  /// Returns by how many steps of the load that remains its noise may exceed it in all.
  static double Settling(const Blow& blow);
  /// Returns the impulse of a blow above this load, N s.
  static double ImpulseAbove(const Blow& blow, double load_newtons);
  static double MeanStepS(const Blow& blow);
  /// Sends a pair's blow, and ends it.
  void SendBlow(Pair& pair, double remains_newtons);
  /// Sends an impact, `later_s` after the first one of its blow.
  void SendImpact(const Pair& pair, const Impact& impact, double later_s);
  /// Returns whether most of this step's impulse of the pair is where its last blow did not strike,
  /// and is not feeble.
  bool StrikesElsewhere(const Pair& pair);
  /// Returns the time of a touch of a blow that is over in this step.
  double TimeOf(const Bodies& bodies, const Blow& blow, const PairTouch& touch) const;
  bool gathers() const;
  static ForceKnot MakeKnot(std::span<const Force> forces, double step_s);

  double nominal_step_s_;
  double step_s_ = 0;  // time since the previous step
  std::optional<double> time_s_;
  std::optional<double> previous_time_s_;
  std::vector<Force> forces_;       // of this step
  std::vector<Object> objects_;     // ascending by handle
  std::vector<PairTouch> touches_;  // of this step
  std::vector<Pair> pairs_;         // ascending by bodies
  std::set<Bodies> new_pairs_;      // pairs of this step that are not in pairs_ yet
  std::vector<ForceEvent> events_;  // those of the last call
  RecentPoses poses_;
  bool follows_ = false;         // whether no step is missing before this step
  std::vector<Motion> motions_;  // ascending; of this step, if it was asked for
  double gap_s_ = 0;             // time since the previous step that was sent
  double first_time_s_ = 0;
  // Number of the newest steps that were sent without contacts, with no step missing between them.
  // It stays at kEmptySteps, because such a client leaves out no step.
  int empty_step_count_ = 0;
  BlowCounts counts_;
};

}  // namespace carillon
