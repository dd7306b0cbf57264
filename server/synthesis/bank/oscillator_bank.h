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
#include "server/synthesis/bank/acceleration_noise.h"
#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/bank/directed_gains.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/bank/long_segment.h"
#include "server/synthesis/bank/multiplets.h"
#include "server/synthesis/bank/shape_table.h"
#include "server/synthesis/bank/sounding_modes.h"
#include "server/synthesis/bank/sustained_force.h"
#include "server/synthesis/ringing/lane_arrays.h"
#include "server/synthesis/ringing/lane_mix.h"
#include "server/synthesis/ringing/ring_kernel.h"
#include "server/synthesis/ringing/strike_kernel.h"
#include "server/synthesis/schedule/due_event.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

struct LanePlan;

/// Settings of a bank.
struct OscillatorBankSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  double gain = 1;                 ///< linear
  uint64_t noise_seed = 0;         ///< of the roughness noise
  double silence = 1e-7;           ///< modes below this amplitude (-140 dB) are put to sleep
  /// The directions in which the modes radiate. If set, the bank must be rendered apart (BlockMix)
  /// and in the time domain only (LeaveSpectrum). If absent, the modes radiate equally in all
  /// directions.
  std::optional<HeardDirectivity> directivity = std::nullopt;
  /// The body whose acceleration sounds in each blow, with the vertices of the shape table. If
  /// absent, only the modes sound.
  std::optional<MovedBody> moved = std::nullopt;
};

/// All modes of one sounding object, each a decaying complex exponential (the paper, 3.4):
///
///   Z_m(n+1) = q_m Z_m(n),  q_m = exp((sigma_m + i omega_m) / sample rate),  output = sum Re Z_m
///
/// or, for a bank with directivity, output = sum Re (gain_m Z_m) with the gains of DirectedGains.
/// While the gains move, the states are rendered twice, with the gains of the block's start and of
/// its end, and one rendering fades into the other. In such a bank, a block with impulses is
/// rendered once more, only to advance the states.
///
/// An impulse J adds -i c_m g_m / omega_m exp(i phase_m) exp(s_m^2 tau^2 / 2) to Z_m at its time,
/// with g_m = sum_v w_v phi_m(v) . J and s_m = sigma_m + i omega_m. The last factor is that of a
/// Gaussian pulse, and is exact once the contact is over (where sigma^2 > omega^2, exp(-|s_m|^2
/// tau^2 / 2) replaces it). The default pulse is a raised cosine, which has another factor in its
/// place (strike_kernel::Onset).
///
/// A struck mode rings in the time domain, SIMD across modes: in single precision within a block,
/// in double between blocks, which keeps the error below -100 dB. At the start of the next long
/// block of the mode's kind (the kinds differ in length, see LongBlock), its state is added to the
/// state that already rings by spectrum; by linearity the sum is the same sound. Modes that decay
/// too fast for any long block stay in the time domain, and so does a bank that is struck all the
/// time. Modes below -140 dB of full scale are put to sleep, in groups of kMostLanes.
///
/// The second mode of a degenerate pair is a cosine, which would begin with a jump and click under
/// a soft mallet. Therefore it has a companion of the same frequency and opposite sign that decays
/// by exp(-1) in a radian. Their sum, cos(omega t) (exp(sigma t) - exp((sigma - omega) t)), begins
/// at zero with the slope of the pair's first mode. In a bank with directivity each mode has such a
/// companion. Three or more degenerate modes ring as one (Multiplets).
///
/// A bank may have no modes. Then only the acceleration of its body sounds.
///
/// Any thread may construct a bank; then one thread at a time uses it. Only the constructor
/// allocates; nothing locks. In each block of the mix, impulses and knots come first and RenderAdd
/// last, without calls to another bank in between.
class OscillatorBank {
 public:
  /// Lanes and columns may number at most StrikeBatch::kMostBankLanes each.
  OscillatorBank(const SoundingModes& sounding, const ShapeTable& shapes,
                 const OscillatorBankSettings& settings);

  /// Applies an impulse. The impulse is first audible at sample `offset` of the block of `mix`.
  /// This sample lies `lead_frames` (0 to 1) frames after the time of the impulse. Offsets ascend
  /// within a block. Returns false, without effect, if the impulse is not finite or names a vertex
  /// that the body lacks.
  bool Strike(const SurfaceImpulse& impulse, size_t offset, float lead_frames,
              BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Applies the impulses of `events`, which are neighbours in time within this block, as one
  /// onset, which costs less. Each acts at the nearest vertex of its triangle, and all act at their
  /// mean time, weighted by their magnitudes.
  bool StrikeMerged(std::span<const DueEvent> events, BlockMix& mix) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Returns the frames from the start of an impulse's contact to the impulse's time, or zero if
  /// the bank needs no BeginContact.
  double ContactLeadFrames(Pulse pulse) const noexcept;

  /// Begins the sound of the body's acceleration by an impulse whose contact begins at sample
  /// `offset`, as for Strike. Returns false, without effect, if the bank has no acceleration noise
  /// or the body lacks a vertex of the impulse.
  bool BeginContact(const SurfaceImpulse& impulse, size_t offset, float lead_frames) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Returns the rows of the shape table that these events, one or several merged, will read first.
  StrikeBatch::RowsAhead RowsOf(std::span<const DueEvent> events) const noexcept;

  /// Adds a contact's force to the whole force of the next knot. Returns false, without effect, if
  /// the force names a vertex that the body lacks.
  bool AddForce(const SurfaceForce& force) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Ends a step of the sustained force at sample `offset`, as for Strike. The forces added since
  /// the previous knot become the whole force. Returns false if this force was not finite; it is
  /// then zero.
  bool ApplyKnot(const ForceKnot& knot, size_t offset, BlockMix& mix) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Adds the bank's block to `mix`. Returns false if the state was not finite; the bank is then
  /// silenced.
  bool RenderAdd(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Makes the bank ring in the time domain only, from the next long block of each kind on.
  void LeaveSpectrum() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) {
    leaving_spectrum_ = true;
  }

  /// Whether the bank neither sounds in a current long block nor will in a later one.
  bool out_of_spectrum() const noexcept;

  /// Does the same as RenderAdd. The bank must be out_of_spectrum() and must not be struck in this
  /// block.
  bool RenderAddInTime(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Returns the gains towards the listener, or null if the bank radiates equally in all
  /// directions. The caller calls their BeginBlock in each block, before impulses, knots and
  /// RenderAdd.
  DirectedGains* gains() noexcept { return gains_.get(); }

  /// Whether rendering the bank would add nothing.
  bool silent() const noexcept {
    return modes_silent() && (moved_ == nullptr || !moved_->active());
  }

  /// Number of modes that still ring.
  size_t active_mode_count() const noexcept { return struck() ? mode_count_ : active_mode_count_; }

  /// These four functions return the units of work (work_budget.h) of a block without events, of an
  /// impulse, of a merged impulse, and of the lanes that a first impulse awakens.
  double ringing_work() const noexcept;
  double strike_work() const noexcept;
  double merged_strike_work() const noexcept;
  double awakening_work() const noexcept;

  /// Returns the approximate loudness of an impulse of 1 N s. It is the root of the sum of the
  /// modes' squared amplitudes, which is averaged over the surface and the three axes.
  float loudness_per_newton_second() const noexcept { return loudness_per_newton_second_; }

  /// Returns the largest squared amplitude of a ringing mode, at the end of the last block or at
  /// the start of its current long block.
  double loudest_squared() const noexcept;

  /// Lowers the bank if a mode is louder than kMostAmplitude, and returns whether it did. Its part
  /// of a current long block is heard as it is until that long block ends.
  bool BoundLoudness() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);

  /// Silences the bank and ends its sustained forces. Its part of a current long block sounds until
  /// that long block ends.
  void Shed() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) { Silence(); }

  /// Silences the modes and the acceleration noise. The caller must call it between two blocks, and
  /// must also call BlockMix::Silence, which silences the part of a current long block. Sustained
  /// forces are kept, so that a resting load makes no new sound.
  void Hush() noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole) { SilenceLanes(); }

  /// Number of modes of the object.
  size_t mode_count() const noexcept { return mode_count_; }

 private:
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
    kInParts,  ///< rendered up to rendered_to, where the start and fresh states of the lanes are
  };
  /// The current block.
  struct Block {
    Phase phase = Phase::kWaiting;
    bool by_frames = false;  ///< all lanes use tiles of the first kind
    bool finite = true;      ///< whether all states were finite so far
    size_t rendered_to = 0;  ///< frames of the block that are rendered already
  };
  /// Where any lane is awake.
  enum class Ringing : uint8_t { kNowhere, kInSpectrum, kInTime };

  OscillatorBank(const LanePlan& plan, const SoundingModes& sounding, ShapeTable shapes,
                 const OscillatorBankSettings& settings);

  bool modes_silent() const noexcept {
    return !struck() && ringing_ == Ringing::kNowhere && !force_.driving();
  }
  bool struck() const noexcept { return block_.phase >= Phase::kStruck; }

  void BeginBlock(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool BeginLongBlock(size_t kind, BlockMix& mix) noexcept;
  std::optional<strike_kernel::Projection> Project(
      const TrianglePoint& at, const std::array<float, 3>& vector) const noexcept;
  void AddVertex(size_t vertex, float weight, const std::array<float, 3>& vector,
                 strike_kernel::Projection& projection) const noexcept;
  bool RenderModes(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool RenderModesInTime(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderAcceleration(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void SetSegments(const LanePlan& plan);
  double TimeWork(size_t lane_count) const noexcept;
  void SetDirectivity(const SoundingModes& sounding, const LanePlan& plan,
                      const OscillatorBankSettings& settings);
  bool gains_move() const noexcept { return gains_ != nullptr && gains_->moving(); }
  /// Returns `offset`, delayed to the last onset in the batch or to the part that is not yet
  /// rendered, because merged impulses come after exact ones of the same group of frames.
  size_t NotBeforeTheLast(size_t offset, const StrikeBatch& batch) const noexcept;
  void NoteOnset(size_t offset, StrikeBatch& batch) noexcept;
  void BeginStrikes(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool StrikeModes(size_t offset, strike_kernel::Onset onset, const OctaveGains& gains,
                   BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderStrikes(size_t end, BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderDrivenStrikes(size_t end, BlockMix& mix) noexcept
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  void RenderDriven(size_t end, BlockMix& mix) noexcept;
  /// Renders the block up to frame `end` with the gains, and leaves the states as they are.
  void HearStruck(size_t end, BlockMix& mix) noexcept;
  /// Returns the buffer for the rendering that advances the states. It is unheard if there are
  /// gains.
  LaneMix& Advanced(BlockMix& mix) const noexcept {
    return gains_ == nullptr ? mix.lanes() : mix.unheard();
  }
  /// Prepares the sums for rendering the block up to frame `end`; FinishPart adds them to `lanes`.
  ring_kernel::StruckPart BeginPart(size_t end, StrikeBatch& batch, LaneMix& lanes) const noexcept;
  void FinishPart(const ring_kernel::StruckPart& part, LaneMix& lanes) const noexcept;
  ring_kernel::TileSums Sums(NodeMix& nodes, size_t frame_count, LaneMix& mix) const noexcept;
  bool FinishStruck(BlockMix& mix) noexcept ABSL_EXCLUSIVE_LOCKS_REQUIRED(kRenderRole);
  bool EndBlock() noexcept;
  static_assert(kMostSegments == 1 + kLongBlockKinds);
  using Counts = std::array<size_t, kMostSegments>;
  Counts AwakeCounts() const noexcept;
  void Silence() noexcept;
  void SilenceLanes() noexcept;
  void CountAwake() noexcept;

  ShapeTable shapes_;
  size_t block_frame_count_;
  double silence_squared_;
  size_t mode_count_;
  size_t lane_count_;  // modes and companions, each kind padded to whole vectors
  Multiplets multiplets_;
  std::array<RingingSegment, kMostSegments> segments_;  // the first for the time domain only
  Counts counted_{};                        // awake lanes of each segment at the last CountAwake
  std::vector<LongSegment> long_segments_;  // kLongBlockKinds of them
  // Modes in each group of kMostLanes lanes, by segment.
  std::vector<uint32_t> group_mode_counts_;
  // A block without events in which the bank rings by spectrum reads only the members from here to
  // the start of force_, so that a thousand banks cost few cache misses.
  Block block_;
  Ringing ringing_ = Ringing::kNowhere;
  bool awake_changed_ = false;     // the awake lanes are to be counted again
  bool loudness_changed_ = false;  // since BoundLoudness
  bool leaving_spectrum_ = false;
  size_t active_mode_count_ = 0;
  double ringing_work_ = 0;
  float loudness_per_newton_second_ = 0;
  std::unique_ptr<DirectedGains> gains_;
  std::unique_ptr<AccelerationNoise> moved_;
  SustainedForce force_;
  LaneArrays lanes_;
};

/// The SIMD target in use on this machine ("AVX3", "AVX2", "SSE4", "NEON", ...).
std::string_view SimdTarget();

}  // namespace carillon
