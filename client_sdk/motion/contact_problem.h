// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "client_sdk/motion/contact_search.h"
#include "client_sdk/motion/hop_series.h"
#include "client_sdk/motion/momentum_balance.h"

namespace carillon::motion {

/// Blows of a pair that lie within this number of bins cannot be told apart in time.
inline constexpr double kBinsAtOnce = 2.5;

/// The balance of a motion with one unknown for each candidate, and how it is solved.
class ContactProblem {
 public:
  /// The blows of `series` are taken as they are.
  ContactProblem(const Motion& motion, const SearchBodies& bodies, const ContactSearch& search,
                 std::vector<Candidate> candidates, const std::vector<HopSeries>& series);

  /// Solves, removes the bias of the costs, and joins impulses that cannot be told apart. With a
  /// `variant` above zero each cost is multiplied by a number of its own from 1/2 to 2, and
  /// nothing is joined.
  void Solve(int variant = 0);

  const std::vector<Candidate>& candidates() const { return candidates_; }
  const Vector& value(size_t candidate) const { return balance_.value(candidate); }
  const MomentumBalance& balance() const { return balance_; }
  /// The time of a blow since the first frame, s; of a load, that of its frame.
  double TimeOf(const Candidate& candidate) const;
  /// Tells the motions of bodies what was found.
  void Tell(std::vector<BodyMotion>& motions) const;

 private:
  struct Cluster {
    size_t first = 0, last = 0;   ///< bins since the beginning, the last included
    size_t middle = 0;            ///< all is to be moved to this bin and its two neighbours
    std::vector<size_t> members;  ///< blows of the pair in these bins, and faint loads around
    std::vector<Vector> before;   ///< their values
  };
  void AddNodes(const Motion& motion, const SearchBodies& bodies, const ContactSearch& search);
  void AddGiven(const SearchBodies& bodies, const FoundBlow& blow);
  void AddUnknown(const Candidate& candidate);
  void AddJoints(const Motion& motion, const SearchBodies& bodies);
  size_t BinOf(const Candidate& candidate) const;
  std::vector<double> BlowTimes() const;
  std::vector<Cluster> FindClusters() const;
  void AddMembers(uint32_t pair, double impulse, Cluster& cluster) const;
  void Join(Cluster& cluster);
  double ResidualAround(const Cluster& cluster, double& given) const;

  size_t frames_;
  double frame_s_;
  size_t bins_;
  const std::vector<BodyPair>& pairs_;
  std::vector<Candidate> candidates_;
  std::vector<std::vector<std::vector<BodyImpulse>>>
      given_;  ///< by series, for each body and interval
  std::vector<std::vector<size_t>> blows_of_pair_, loads_of_pair_;
  std::vector<bool> balanced_;
  MomentumBalance balance_;
};

}  // namespace carillon::motion
