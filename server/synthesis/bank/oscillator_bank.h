// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/base/thread_role.h"
#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/bank/shape_table.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/bank/sustained_force.h"
#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/lane_mix.h"
#include "server/synthesis/ringing/ring_kernel.h"
#include "server/synthesis/ringing/strike_kernel.h"
#include "server/synthesis/schedule/due_event.h"
#include "server/synthesis/schedule/mixer_event.h"
#include "server/synthesis/spectrum/spectral_lanes.h"

namespace carillon {

struct LanePlan;

/// How a bank is rendered.
struct OscillatorBankSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  double gain = 1;                 ///< of this object, linear
  uint64_t noise_seed = 0;         ///< of this object's roughness
  double silence = 1e-7;           ///< modes that fall below this amplitude fall asleep: -140 dB
};

/// All modes of one sounding object, each a decaying complex exponential (the paper, 3.4):
///
///   Z_m(n+1) = q_m Z_m(n),  q_m = exp((sigma_m + i omega_m) / sample rate),  output = sum Re Z_m
///
/// A strike adds -i c_m g_m / omega_m exp(i phase_m) exp(s_m^2 tau^2 / 2) to Z_m at its time, with
/// g_m = sum_v w_v phi_m(v) . J and s_m = sigma_m + i omega_m; the last factor is the Gaussian
/// contact, exact once the contact is over (where sigma^2 > omega^2, exp(-|s_m|^2 tau^2 / 2)
/// instead).
///
/// What was struck rings in the time domain, SIMD across modes: float within a block, between
/// blocks in double, which holds the error below -100 dB. At the next long block of its kind a mode
/// goes over to the spectral form, by linearity: the state that was struck since is added to the
/// one that rings on by spectrum, and both are the same sound. Modes too short for any long block
/// stay in the time domain, and so does a bank that is struck all the time. Modes that fall below
/// -140 dB of full scale fall asleep, in groups of kMostLanes.
///
/// The second mode of a degenerate pair is a cosine, which would begin with a jump: a click under a
/// soft mallet. It comes with a companion of the same frequency and opposite sign that decays by
/// exp(-1) in a radian: the sum, cos(omega t) (exp(sigma t) - exp((sigma - omega) t)), begins at
/// zero with the slope of its sibling.
///
/// Made anywhere; then used by one thread at a time, which neither allocates nor locks. In each
/// block of the mix: first the strikes, then RenderAdd, with no other bank's calls between them.
class OscillatorBank {
 public:
  /// At most StrikeBatch::kMostBankLanes lanes and columns.
  OscillatorBank(const SoundingModes& sounding, const ShapeTable& shapes,
                 const OscillatorBankSettings& settings);

  /// Applies an impulse at sample `offset` of the block of `mix`, `lead_frames` (0 to 1) after
  /// it happened. Offsets within one block may not go back. False: not finite or no such vertex,
  /// and nothing was done.
  bool Strike(const SurfaceImpulse& impulse, size_t offset, float lead_frames,
              BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// The same with the modal impulses g_m, but for the scale of the shapes, of the projected
  /// columns (column_count() of them): what is not a single impulse on a triangle comes in here.
  /// Tiles are this function's matter, not the caller's.
  bool StrikeModes(std::span<const float> modal_impulses, size_t offset, strike_kernel::Onset onset,
                   BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Strikes that sound as one, which costs less: each on the nearest vertex of its triangle, all
  /// at their mean time, weighted by impulse. They are neighbours in time, and lie in this block.
  bool StrikeMerged(std::span<const DueEvent> events, BlockMix& mix) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// What strikes, one or some merged, will read.
  StrikeBatch::RowsAhead RowsOf(std::span<const DueEvent> events) const noexcept;

  /// Adds a contact's force to that at the next knot. False: no such vertex, and nothing was done.
  bool Gather(const SurfaceForce& force) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// The sustained force has come to what was gathered, at sample `offset` as for Strike. False: it
  /// was not finite, and is zero.
  bool Tie(const ForceKnot& knot, size_t offset, BlockMix& mix) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Adds the block to `mix`. False: the state was not finite and the bank has been silenced.
  bool RenderAdd(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// From its next long blocks on the bank rings in the time domain only.
  void LeaveSpectrum() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    leaving_spectrum_ = true;
  }

  /// Nothing of the bank sounds in a long block that is under way or to come.
  bool out_of_spectrum() const noexcept;

  /// RenderAdd for a bank out of the spectrum, not struck in this block.
  bool RenderAddInTime(LaneMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// True: rendering the bank would add nothing.
  bool silent() const noexcept {
    return !struck() && ringing_ == Ringing::kNowhere && !force_.driving();
  }

  /// Modes that still ring.
  size_t active_mode_count() const noexcept { return struck() ? mode_count_ : active_mode_count_; }

  /// Units of work (work_budget.h) that a block takes: now, of a strike, and of what a first strike
  /// brings with it.
  double ringing_work() const noexcept { return ringing_work_; }
  double strike_work() const noexcept;
  double merged_strike_work() const noexcept;
  double awakening_work() const noexcept;

  /// How loud, about, a blow of one newton second is: root of the mean over the surface of the sum
  /// of the modes' squared amplitudes.
  float loudness_of_blow() const noexcept { return loudness_of_blow_; }

  /// The largest squared amplitude of a mode that rings, lately.
  double loudest_squared() const noexcept;

  /// Silences the bank; what of it sounds in a long block under way ends with that.
  void Shed() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) { Silence(); }

  /// Columns of the shape table that are projected, from the first mode's on.
  size_t column_count() const noexcept { return column_count_; }

  /// Modes of the object.
  size_t mode_count() const noexcept { return mode_count_; }

 private:
  /// Lanes that may ring by spectrum, in long blocks of one kind.
  struct LongSegment {
    SpectralLanes lanes;
    size_t mode_count = 0;
    size_t block_count = 1;  // of the mixer's in a long one
    double loudest_squared = 0;
    bool awake = false;
    bool sounding = false;       // in the long block under way
    bool struck = false;         // since that began
    uint32_t struck_streak = 0;  // long blocks on end in which it was struck
  };

  /// How far the bank has come in the current block:
  ///
  ///             BeginBlock         first onset         a part must be rendered
  ///                                                    before the block's end
  ///   kWaiting ------------> kBegun ------------> kStruck -----------> kInParts
  ///      ^                     |                     |                    |
  ///      +---------------------+------ EndBlock -----+--------------------+
  ///
  /// A knot, or a force that drives the modes, leads from kBegun to kInParts at once. A refused
  /// onset of a silent bank leads back to kWaiting, because a silent bank is not rendered.
  enum class Phase : uint8_t {
    kWaiting,
    kBegun,    ///< the long blocks that begin with this block have begun
    kStruck,   ///< the batch holds onsets, which are rendered at the end of the block
    kInParts,  ///< the block is rendered up to rendered_to, from start and newborn states on
  };
  /// The current block.
  struct Block {
    Phase phase = Phase::kWaiting;
    bool by_frames = false;  ///< all lanes go in tiles of the first kind
    bool finite = true;
    size_t rendered_to = 0;  ///< frames
  };
  /// Where any lane is awake.
  enum class Ringing : uint8_t { kNowhere, kInSpectrum, kInTime };

  OscillatorBank(const LanePlan& plan, const SoundingModes& sounding, ShapeTable shapes,
                 const OscillatorBankSettings& settings);

  bool struck() const noexcept { return block_.phase >= Phase::kStruck; }

  void BeginBlock(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool BeginLongBlock(size_t kind, BlockMix& mix) noexcept;
  void MoveToSpectrum(size_t kind) noexcept;
  void MoveToTime(size_t kind) noexcept;
  std::optional<strike_kernel::Projection> Project(
      const TrianglePoint& at, const std::array<float, 3>& vector) const noexcept;
  void AddVertex(size_t vertex, float weight, const std::array<float, 3>& vector,
                 strike_kernel::Projection& projection) const noexcept;
  void SetSegments(const LanePlan& plan);
  void MeasureBlow(const LanePlan& plan);
  double TimeWork(size_t lane_count) const noexcept;
  /// Strikes that were merged come after others that they may lie before: these are added later
  /// then, as they would sound there.
  size_t NotBeforeTheLast(size_t offset, const StrikeBatch& batch) const noexcept;
  void NoteOnset(size_t offset, StrikeBatch& batch) noexcept;
  void BeginStrikes(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderStrikes(size_t end, BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderDrivenStrikes(size_t end, BlockMix& mix) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderDriven(size_t end, LaneMix& mix) noexcept;
  /// Begins and ends what a part needs of a mix.
  ring_kernel::StruckPart BeginPart(size_t end, BlockMix& mix) const noexcept;
  void FinishPart(const ring_kernel::StruckPart& part, BlockMix& mix) const noexcept;
  ring_kernel::TileSums Sums(NodeMix& nodes, size_t frame_count, LaneMix& mix) const noexcept;
  bool FinishStruck(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool EndBlock() noexcept;
  static_assert(kMostSegments == 1 + kLongBlockKinds);
  using Counts = std::array<size_t, kMostSegments>;
  Counts AwakeCounts() const noexcept;
  void Silence() noexcept;
  void CountAwake() noexcept;

  ShapeTable shapes_;
  size_t block_frame_count_;
  double silence_squared_;
  size_t mode_count_;
  size_t lane_count_;  // modes and companions, each kind padded to whole vectors
  uint32_t first_column_;
  size_t column_count_;
  std::array<RingingSegment, kMostSegments> segments_;  // the first for the time domain only
  Counts counted_{};                        // what of them was awake when that was counted
  std::vector<LongSegment> long_segments_;  // kLongBlockKinds of them
  std::vector<uint8_t>
      group_mode_counts_;  // modes, not companions, of kMostLanes lanes, by segment
  Block block_;
  Ringing ringing_ = Ringing::kNowhere;
  bool awake_changed_ = false;  // the awake lanes are to be counted again
  bool leaving_spectrum_ = false;
  size_t active_mode_count_ = 0;
  double ringing_work_ = 0;
  float loudness_of_blow_ = 0;
  LaneArrays lanes_;
  SustainedForce force_;
};

/// The SIMD target in use on this machine ("AVX3", "AVX2", "SSE4", "NEON", ...).
std::string_view SimdTarget();

}  // namespace carillon
