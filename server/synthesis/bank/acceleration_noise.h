// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>

#include "server/base/fixed_vector.h"
#include "server/base/rigid_radiation.h"
#include "server/synthesis/bank/harmonic_basis.h"
#include "server/synthesis/schedule/bearing.h"
#include "server/synthesis/schedule/mixer_event.h"

namespace carillon {

/// A rigid body as an object of a scene. The vertices belong to `owner`.
struct MovedBody {
  RigidRadiation body;
  double density_kg_per_m3 = 0;
  double size = 1;                                   ///< relative to the size of `body`
  std::span<const std::array<float, 3>> vertices{};  ///< of the sounding surface, unscaled
  std::shared_ptr<const void> owner = nullptr;
  double air_density_kg_per_m3 = 1.204;
  double sound_speed_m_per_s = 343;
};

/// The sound of a body's own acceleration in a blow (Chadwick, Zheng and James, "Precomputed
/// acceleration noise for improved rigid-body sound", 2012). An impulse J at the point r gives the
/// six accelerations
///
///   A = J w(t)/m along the axes,  A = I^(-1) (r - center) x J w(t) about them,
///
/// where w(t) is the pulse of the contact. With s' = a s/c, each acceleration A gives at 1 m the
/// pressure
///
///   rho0 a^2 A (S_1 s'/(2 + 2 s' + s'^2) + S_2 s'^2/(9 + 9 s' + 4 s'^2 + s'^3)),
///
/// where S_l is the sum over m of s_lm Y_lm towards the listener. Without directions, the pattern
/// of each l is replaced by its root mean square over all directions, and the motions sound in
/// phase.
///
/// For w = (1 - cos(W t))/T from 0 to T, W = 2 pi/T, the response is known exactly. With the poles
/// p and residues R of a term H, the response is
///
///   (sum of K exp(p t) - Re(H(i W) exp(i W t)))/T,   K = R W^2/(p (p^2 + W^2)),
///
/// until T, and the sum of K (exp(p t) - exp(p (t - T)))/T afterwards. The terms K exp(p t) of all
/// pulses with the same pole p are advanced as one number. In addition, each pulse has a sinusoid
/// of its own while it lasts. A pulse lasts at least two frames. A pulse of another shape is
/// replaced by the raised cosine of the same variance. The middle of a pulse lies at the time of
/// its impulse, as for modes, so Begin is called half of PulseFrames earlier. Neither this sound
/// nor the modes include the time a/c that a wave takes between a body's surface and its centre.
///
/// Any thread may construct the object; then one thread at a time uses it. Only the constructor
/// allocates; nothing locks.
class AccelerationNoise {
 public:
  /// The number of pulses of one body that may sound at once. A further impulse joins the pulse
  /// most like its own that is about to start. If all sound already, it adds no acceleration noise.
  static constexpr size_t kMostPulses = 16;

  /// `samples_per_pascal` includes the object's gain.
  AccelerationNoise(const MovedBody& moved, double sample_rate_hz, double samples_per_pascal);

  /// Returns the duration of a pulse in frames: at least 2 frames, at most 0.15 s.
  static double PulseFrames(Pulse pulse, double sample_rate_hz) noexcept;
  double PulseFrames(Pulse pulse) const noexcept { return PulseFrames(pulse, rate_); }

  /// Starts the pulse of an impulse. The pulse starts `lead_frames` (0 to 1) frames before sample
  /// `offset` of the next block, which is the first sample in which it sounds. The impulse must act
  /// on vertices of the body. If `bearing` is null, directions are ignored.
  void Begin(const SurfaceImpulse& impulse, size_t offset, float lead_frames,
             const Bearing* bearing) noexcept;

  /// Adds a block to `frames`.
  void RenderAdd(std::span<float> frames) noexcept;

  /// Whether anything sounds.
  bool active() const noexcept { return !pulses_.empty() || decaying_; }

  /// Ends all sound.
  void Silence() noexcept;

 private:
  static constexpr size_t kMotions = 6;
  static constexpr size_t kSources = 2 * kMotions;  // dipole and quadrupole of each motion
  static constexpr size_t kPoles = 3 * kMotions;    // a pair each, and a real pole per quadrupole

  using Weights = std::array<double, kSources>;
  struct Number {
    double re = 0, im = 0;
  };
  /// A real pole p of a source's transfer function, or the pole of a conjugate pair that has a
  /// positive frequency.
  struct Pole {
    size_t source = 0;
    Number p{};        // 1/s
    Number residue{};  // doubled for a pair, of which only the real part is used
    Number step{};     // exp(p / sample rate)
    Number state{};
  };
  /// A pulse that sounds or is about to start.
  struct ActivePulse {
    size_t begin = 0, end = 0;  // frames from the start of the next block to render
    double lead_s = 0;          // from the contact's start to frame `begin`
    double end_lead_s = 0;      // from the contact's end to frame `end`
    double duration_s = 0;
    bool begun = false;
    Number phasor{}, turn{};  // the sinusoid at `begin`, and its step in a frame
    Weights weights{};
  };

  using Accelerations = std::array<double, kMotions>;

  void AddPoles(size_t source, double speed_per_radius);
  Accelerations AccelerationsBy(const SurfaceImpulse& impulse) const noexcept;
  Weights WeightsTowards(const Bearing& bearing, const Accelerations& by) noexcept;
  Weights MeanWeights(const Accelerations& by) const noexcept;
  ActivePulse* MostLike(size_t begin, double duration_s) noexcept;
  Number ResponseAt(size_t source, double rad_per_s) const noexcept;
  void Kick(const ActivePulse& pulse, double sign, double time_s) noexcept;
  size_t StartAndEndPulses(size_t at, size_t frame_count) noexcept;
  void RenderPart(std::span<float> frames) noexcept;
  void NoteDecay() noexcept;

  MovedBody moved_;
  double rate_;
  double scale_;                   // samples at 1 m of unit acceleration times a^2 S
  std::array<double, 9> inverse_;  // inverse tensor of inertia, 1/(kg m^2)
  std::array<Pole, kPoles> poles_;
  size_t pole_count_ = 0;
  HarmonicBasis basis_{2};
  FixedVector<ActivePulse> pulses_{kMostPulses};
  bool decaying_ = false;
};

}  // namespace carillon
