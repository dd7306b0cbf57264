// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "client_sdk/motion/contact_features.h"
#include "client_sdk/motion/kinematics.h"
#include "client_sdk/motion/momentum_balance.h"
#include "client_sdk/motion/motion.h"
#include "client_sdk/motion/surface_index.h"

namespace carillon::motion {

/// A place, and a time, at which a contact may have acted.
struct Candidate {
  uint32_t pair = 0;
  uint32_t frame = 0;       ///< the frame of a load, or the one at or before a blow
  uint32_t last_frame = 0;  ///< a load lasts until here while its bodies are still
  int bin = -1;             ///< a blow comes after bin / bin_count of the interval; -1: a load
  ContactFeature feature;
  double slack_m = 0;  ///< how large the gap may be
  Vector arm_a = Vector::Zero(),
         arm_b = Vector::Zero();  ///< from the centres of mass, scene's axes

  bool blow() const { return bin >= 0; }
};

/// Two bodies that may touch.
struct BodyPair {
  uint32_t a = 0, b = 0;
  double tolerance_m = 0;
  double reduced_mass_kg = 0;
  double friction = 0;
  double rounding_m = 0;  ///< the sum of both bodies' roundings
  double offset_m = 0;    ///< the gap at which the engine lets the pair rest
  double nearest_m = 1e300;
};

/// All bodies as the search sees them.
struct SearchBodies {
  std::vector<std::unique_ptr<SurfaceIndex>> surfaces;
  std::vector<BodyMotion> motions;
  std::vector<double> free_speed;  ///< a node with a smaller jump is in free flight, m/s
};

/// Finds the candidates of all pairs of bodies. Where the bodies of a pile are still for several
/// frames, each contact is one candidate for all of them.
class ContactSearch {
 public:
  ContactSearch(const Motion& motion, const SearchBodies& bodies);

  /// Returns the candidates. With `known`, the places of bodies between two frames follow from the
  /// contacts found before.
  std::vector<Candidate> Find(bool known);

  /// Where a pair's bodies are at a time in an interval, and where they may touch if they are
  /// there.
  PairPlacement Place(const BodyPair& pair, size_t interval, double time_s, Path path) const;
  std::vector<ContactFeature> Features(const BodyPair& pair, const PairPlacement& at,
                                       double reach_m) const;

  int bin_count() const { return bin_count_; }
  const std::vector<BodyPair>& pairs() const { return pairs_; }
  /// True if the balance of a node need not be looked at: the frames around it are the same.
  bool Skipped(size_t body, size_t frame) const {
    return skipped_[body][frame] && skipped_[body][frame - 1] && skipped_[body][frame + 1];
  }

 private:
  /// What a pair does at a frame.
  struct PairFrame {
    std::vector<ContactFeature> features;  ///< at the frame itself
    double slack_m = 0;
    bool still = false;
  };
  void FindPairs();
  bool Near(const BodyPair& pair, size_t frame, double margin_m) const;
  double Slack(const BodyPair& pair, size_t interval) const;
  bool Still(size_t body, size_t frame) const;
  bool Acts(size_t body, size_t node) const;
  void FindAtFrames(size_t pair, std::vector<PairFrame>& frames) const;
  void FindOffset(BodyPair& pair, const std::vector<PairFrame>& frames) const;
  void MarkPiles(std::vector<std::vector<PairFrame>>& frames);
  void AddLoads(size_t pair, const std::vector<PairFrame>& frames,
                std::vector<Candidate>& out) const;
  void AddBlows(size_t pair, const std::vector<PairFrame>& frames, bool known,
                std::vector<Candidate>& out) const;
  void Add(Candidate candidate, double time_s, Path path, std::vector<Candidate>& out) const;
  double ApproachSpeed(const Candidate& candidate) const;
  bool IsOfFarSide(const Candidate& candidate) const;

  const Motion& motion_;
  const SearchBodies& bodies_;
  size_t frames_;
  int bin_count_;
  std::vector<BodyPair> pairs_;
  std::vector<std::vector<bool>> still_, acts_, skipped_;
};

}  // namespace carillon::motion
