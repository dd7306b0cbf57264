// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "server/base/clock.h"
#include "server/synthesis/bank/block_mix.h"
#include "server/synthesis/bank/level.h"
#include "server/synthesis/render_threads.h"

namespace carillon {

/// Number of sections that the banks of one bus are spread over.
inline constexpr size_t kSectionCount = BlockMix::kStaggers;

/// Most buses of a mixer, the default one included: twice as many as there are scenes, because the
/// bus of a deleted scene is in use until its objects have faded out.
inline constexpr size_t kMostBuses = 1024;

/// Most blocks that each section renders before the next section begins, if the caller requests
/// several blocks at once.
inline constexpr size_t kBlocksTogether = 16;

/// Most impulses that wait for one block of a mixer with a clock, for each of its frames. To choose
/// their treatment takes about a quarter of the block, even if all are shed. Buses share these
/// places (see PendingEvents): one bus alone has 51 impulses a frame, 2.5 million a second.
inline constexpr size_t kMostImpulsesPerFrame = 64;

/// Most other events that wait for one block of such a mixer. One bus alone has 13,107, which is
/// enough to move 4096 objects, push them and end their step at once.
inline constexpr size_t kMostOthersPerBlock = 16384;

/// Bounds of a mixer, which allocates all its memory in its constructor.
struct MixerSettings {
  double sample_rate_hz = 48000;
  size_t block_frame_count = 128;  ///< at most kMostBlockFrames
  /// At most kMostChannels. With two channels a bank without a voice sounds equally on both; with
  /// more it sounds on the first, the pressure of ambisonics.
  size_t channel_count = 1;
  uint64_t first_frame = 0;  ///< number of the first frame; a multiple of block_frame_count
  size_t most_banks = 8192;  ///< including those that ring out or fade
  size_t most_buses = kMostBuses;
  size_t stagger = 0;  ///< of the default bus; see Mixer::Stagger
  size_t most_streams = 2048;
  /// Events that wait for their block. Buses share these places: see PendingEvents.
  size_t most_pending_events = 262144;
  size_t most_events_per_block = 16384;  ///< taken from the streams; the rest wait there
  /// With a clock, the work of a block is bounded so that its deadline is kept. Events beyond
  /// kMostImpulsesPerFrame and kMostOthersPerBlock are dropped when they are taken. Beyond the
  /// bound the quietest impulses are merged, then shed, then the quietest banks are silenced.
  /// MixerStatistics counts all of these. Without a clock nothing is left out, and the sound
  /// depends on the events only. The clock must outlive the mixer.
  const Clock* clock = nullptr;
  double most_load = 0.7;  ///< fraction of real time that rendering may take
  double gain = 1;         ///< of all buses together, before the limiter
  /// The pressure of a sample of 1. The banks of the mixer are made for it.
  double full_scale_pa = kFullScalePa;
  bool limits = true;  ///< whether the limiter works
  /// Whether each call of Render is given a workspace, so that the mixer needs none of its own.
  bool shares_workspace = false;
  /// Threads that render the sections in parallel. If it is null, the caller's thread renders them
  /// all. The sound is the same bit for bit. The threads must outlive the mixer.
  SectionThreads* threads = nullptr;
  /// Called by OpenStream before it returns, so that whoever pauses rendering begins again.
  std::function<void()> wake = nullptr;
};

}  // namespace carillon
