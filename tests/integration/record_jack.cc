// SPDX-License-Identifier: Apache-2.0
// record_jack PORT SECONDS FILE: records a JACK port, at most so long or until standard input ends,
// as raw 32-bit floats; says "recording" once it does, and in the end what it missed.
#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "tests/integration/jack_capture.h"

namespace carillon {
namespace {

/// Returns when standard input has ended.
void WaitForEnd(double seconds) {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  poll(&input, 1, static_cast<int>(1000 * seconds));
}

int Record(const char* port, double seconds, const char* file) {
  const auto capture = JackCapture::Start(port, seconds);
  if (!capture.ok()) {
    std::cerr << capture.status().message() << '\n';
    return EXIT_FAILURE;
  }
  std::cout << "recording" << std::endl;
  WaitForEnd(seconds);
  (*capture)->Stop();
  const std::span<const float> samples = (*capture)->samples();
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(samples.data()),
            static_cast<std::streamsize>(samples.size_bytes()));
  std::printf(
      "{\"frames\": %zu, \"missed_cycles\": %llu, \"missed_frames\": %lld, \"told_xruns\": %llu}\n",
      samples.size(), static_cast<unsigned long long>((*capture)->missed_count()),
      static_cast<long long>((*capture)->missed_frame_count()),
      static_cast<unsigned long long>((*capture)->told_xrun_count()));
  return out.good() ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace carillon

int main(int argc, char** argv) {
  if (argc != 4) return EXIT_FAILURE;
  return carillon::Record(argv[1], std::atof(argv[2]), argv[3]);
}
