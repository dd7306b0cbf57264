// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace carillon {

/// What a disk may answer to a write.
enum class DiskFault {
  kFull,        ///< ENOSPC, after half of the bytes
  kReadOnly,    ///< nothing is written
  kWriteError,  ///< EIO, after half of the bytes; a sync or truncation fails, too
  kReadError,   ///< EIO, of reads instead of writes
};

/// While it lives, every file that SQLite opens in this process is on a disk that fails, from a
/// given access on until it is repaired, or that holds its writes, or the reads of some threads,
/// until they are released. One at a time.
class FaultyDisk {
 public:
  FaultyDisk();
  FaultyDisk(const FaultyDisk&) = delete;
  FaultyDisk& operator=(const FaultyDisk&) = delete;
  ~FaultyDisk();

  /// The first `good_count` accesses of the kind that `fault` hits go well, the others do not.
  static void FailAfter(int64_t good_count, DiskFault fault);

  /// Whether any access has failed since FailAfter; all go well from now on.
  static bool Repair();

  /// The next `good_count` writes, syncs and truncations return; later ones wait for ReleaseWrites.
  static void HoldWritesAfter(int64_t good_count);

  /// Whether a write is held now, or comes to be held within a minute.
  static bool AwaitHeldWrite();

  static void ReleaseWrites();

  /// Whether SQLite finds no space for its temporary files, as on a full $TMPDIR.
  static void SetTemporaryFolderFull(bool is_full);

  /// All reads of this thread wait for ReleaseReads.
  static void HoldReadsOfThisThread();

  /// Whether a read is held now, or comes to be held within a minute.
  static bool AwaitHeldRead();

  static void ReleaseReads();
};

}  // namespace carillon
