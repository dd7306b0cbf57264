// SPDX-License-Identifier: Apache-2.0
#include "server/decomposition/worker/run_command.h"

#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

#include "proto/cpp/program/child_process.h"

namespace carillon {
namespace {

using std::chrono::steady_clock;

constexpr std::chrono::seconds kPatience(30);
constexpr size_t kReplyBytes = 64 << 10;

/// A file in memory that is gone with the object.
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& content)
      : descriptor_(memfd_create("input", MFD_CLOEXEC)) {
    for (size_t at = 0; descriptor_ >= 0 && at < content.size();) {
      const ssize_t written = write(descriptor_, content.data() + at, content.size() - at);
      if (written <= 0) break;
      at += static_cast<size_t>(written);
    }
    if (descriptor_ >= 0) lseek(descriptor_, 0, SEEK_SET);
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() {
    if (descriptor_ >= 0) close(descriptor_);
  }

  int descriptor() const { return descriptor_; }  // -1: there is none

 private:
  int descriptor_;
};

/// Whether bytes or the end of the output arrive before the deadline.
bool AwaitOutput(const Pipe& pipe, steady_clock::time_point deadline) {
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - steady_clock::now());
    pollfd polled{pipe.read_end(), POLLIN, 0};
    const int ready = poll(&polled, 1, static_cast<int>(std::max<int64_t>(0, left.count())));
    if (ready >= 0 || errno != EINTR) return ready > 0;
  }
}

}  // namespace

CommandResult RunCommand(const std::vector<std::string>& command, const std::string& input) {
  const MemoryFile file(input);
  absl::StatusOr<Pipe> output = Pipe::Make();
  if (file.descriptor() < 0 || !output.ok() || !output->DoNotWait().ok()) return {};
  absl::StatusOr<ChildProcess> child = ChildProcess::Start({.words = command,
                                                            .input = file.descriptor(),
                                                            .output = output->write_end(),
                                                            .errors = output->write_end()});
  if (!child.ok()) return {};
  output->CloseWriteEnd();
  const auto deadline = steady_clock::now() + kPatience;
  CommandResult result;
  while (output->read_end() >= 0) {
    if (!AwaitOutput(*output, deadline)) {
      child->Kill();
      break;
    }
    result.output += output->Read(kReplyBytes);
  }
  const ProcessEnd end = child->Wait();
  result.success = end.exited && end.status == 0;
  return result;
}

}  // namespace carillon
