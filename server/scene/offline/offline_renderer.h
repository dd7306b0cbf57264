// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/scene/offline/forward_renderer.h"

namespace carillon {

/// The result of an offline rendering.
struct OfflineSummary {
  uint64_t frame_count = 0;
  uint64_t accepted_count = 0;
  uint64_t rejected_count = 0;
  absl::Status last_rejection;  ///< reason of the newest rejection; OK if none
  double peak = 0;              ///< largest sample before the limiter
  uint64_t limited_frame_count = 0;
  IntakeFindings findings;
  /// Objects that sound by the paper's coupling because no transfer fits their material.
  uint32_t paper_coupling_object_count = 0;
};

/// Renders a recorded simulation from its first frame to the end of its sound. Steps may be given
/// to the renderer while it renders. As long as steps may follow, the sound after its possible end
/// is kept back, because poses after the last contact do not make the sound longer; of silence only
/// the length is kept. The end fades out over 10 ms. Only one thread at a time may use an object.
class OfflineRenderer {
 public:
  static constexpr size_t kBlockFrameCount = kOfflineBlockFrames;
  static constexpr double kMaxDurationS = ForwardRenderer::kMaxDurationS;

  /// Errors: InvalidArgument (INVALID_SETTINGS), and those of ForwardRenderer::Make.
  static absl::StatusOr<std::unique_ptr<OfflineRenderer>> Make(const OfflineSettings& settings,
                                                               BodyCache& bodies,
                                                               TransferStore* transfers = nullptr);

  /// The renderer that takes the objects and the steps, and ends the simulation.
  ForwardRenderer& forward() { return *forward_; }
  ContactIntake& intake() { return forward_->intake(); }

  /// Renders frames that no step can change any more into `samples`, channels interleaved, until
  /// less than a block fits or all such frames are rendered. `samples` must hold at least one
  /// block. Returns the number of frames. After ForwardRenderer::Finish, zero means that the sound
  /// has ended.
  size_t Render(std::span<float> samples);

  /// The result of all frames rendered so far.
  OfflineSummary summary() const;

  /// Returns the memory that the sound takes which is kept back, bytes.
  size_t held_bytes() const;

 private:
  /// Consecutive frames that may lie after the end of the sound. Without samples they are silent.
  struct Held {
    std::vector<float> samples;
    size_t frame_count = 0;
  };

  explicit OfflineRenderer(std::unique_ptr<ForwardRenderer> forward)
      : forward_(std::move(forward)) {}

  size_t CountReady(size_t most) const;
  size_t KeepBlock(std::span<const float> block, uint64_t frame);
  bool StaysQuiet(std::span<const float> block, uint64_t frame);
  void Hold(std::span<const float> samples);
  size_t GiveHeld(std::span<float> samples);
  size_t HeldFrames() const;
  void FadeHeld();
  uint64_t EndFrame() const;
  size_t FadeFrames() const;

  std::unique_ptr<ForwardRenderer> forward_;
  std::deque<Held> held_;
  bool may_have_ended_ = false;  // whether the sound ends here unless a contact follows
  bool ended_ = false;           // whether `held_` has the fade alone
  uint64_t contact_frame_ = 0;   // last_contact_frame() when may_have_ended_ was set
  uint64_t quiet_frame_count_ = 0;
  uint64_t frame_count_ = 0;
  float loudest_ = 0;  // sample so far, after the limiter
  double peak_ = 0;
};

}  // namespace carillon
