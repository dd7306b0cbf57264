// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "carillon/v1/decomposition.pb.h"
#include "carillon/v1/modal_model_service.pb.h"
#include "carillon/worker/v1/worker.pb.h"
#include "tests/server/mode_database/sample_model.h"

namespace carillon {

/// An event as a worker writes it.
inline std::string EventBytes(const worker::v1::WorkerEvent& event) {
  const std::string body = event.SerializeAsString();
  return std::string(1, static_cast<char>(body.size())) + body;
}

inline std::string ProgressBytes(double fraction) {
  worker::v1::WorkerEvent event;
  event.mutable_progress()->set_phase(v1::PHASE_SOLVE);
  event.mutable_progress()->set_fraction(fraction);
  return EventBytes(event);
}

inline std::string ErrorBytes(const std::string& reason) {
  worker::v1::WorkerEvent event;
  event.mutable_error()->set_reason(reason);
  event.mutable_error()->set_message("as the script was told");
  return EventBytes(event);
}

/// Writes a shell script that stands for carillon-precompute. It finds the mesh in $mesh, the file
/// to write in $out, the request in $request, its band in $band and its number of nodes in $nodes,
/// and its own files in $here; descriptor 3 takes events.
inline std::filesystem::path WriteWorkerScript(const std::filesystem::path& folder,
                                               const std::string& body) {
  std::filesystem::path script = folder / "worker.sh";
  WriteBytes(folder / "worker.new", absl::StrCat("#!/bin/sh\nhere='", folder.string(), R"('
mesh=$1
for option; do
  case $option in
    --out=*) out=${option#--out=} ;;
    --request=*) request=${option#--request=} ;;
  esac
done
band=$(sed -n 's/^m[inax]*_frequency_hz: //p' "$request" | paste -sd :)
nodes=$(sed -n 's/^ *target_node_count: //p' "$request")
)",
                                                 body, "\n"));
  std::filesystem::permissions(folder / "worker.new", std::filesystem::perms::owner_all);
  std::filesystem::rename(folder / "worker.new", script);
  return script;
}

/// A named pipe. By default it opens for reading without waiting for a writer.
class NamedPipe {
 public:
  explicit NamedPipe(const std::filesystem::path& path, int flags = O_RDONLY | O_NONBLOCK) {
    mkfifo(path.c_str(), 0600);
    descriptor_ = open(path.c_str(), flags | O_CLOEXEC);
  }
  NamedPipe(const NamedPipe&) = delete;
  NamedPipe& operator=(const NamedPipe&) = delete;
  ~NamedPipe() { close(descriptor_); }

  /// Whether a writer has had the pipe open and none has now, or comes to that within 20 s.
  bool LosesItsWriters() const {
    pollfd polled{descriptor_, POLLIN, 0};
    while (poll(&polled, 1, 20'000) == 1) {
      char byte = 0;
      if (read(descriptor_, &byte, 1) == 0 && (polled.revents & POLLHUP) != 0) return true;
    }
    return false;
  }

  /// Whether a writer writes something within 20 s.
  bool GetsAByte() const {
    pollfd polled{descriptor_, POLLIN, 0};
    char byte = 0;
    return poll(&polled, 1, 20'000) == 1 && read(descriptor_, &byte, 1) == 1;
  }

  /// Writes a line.
  void WriteLine() const { [[maybe_unused]] const ssize_t n = write(descriptor_, "\n", 1); }

 private:
  int descriptor_;
};

/// A named pipe that scripts wait on ("read line <$here/gate") until they are let through.
struct Gate : NamedPipe {
  explicit Gate(const std::filesystem::path& path) : NamedPipe(path, O_RDWR) {}

  /// Lets one script through, now or when it comes.
  void Open() const { WriteLine(); }
};

/// What an aluminum body of the mesh "solid" is asked for with.
inline v1::CreateModalModelRequest SampleRequest(const std::string& mesh_digest) {
  v1::CreateModalModelRequest request;
  request.set_mesh_digest(mesh_digest);
  request.set_mesh_format("obj");
  request.mutable_material()->set_preset("chime_aluminum");
  return request;
}

}  // namespace carillon
