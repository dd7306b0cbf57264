// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sndfile.h>

#include <string>
#include <vector>

namespace carillon {

struct Wav {
  SF_INFO info{};
  std::vector<float> samples;
};

/// Has no samples where there is no such file.
inline Wav ReadWav(const std::string& path) {
  Wav wav;
  SNDFILE* file = sf_open(path.c_str(), SFM_READ, &wav.info);
  if (file == nullptr) return wav;
  wav.samples.resize(static_cast<size_t>(wav.info.frames * wav.info.channels));
  sf_readf_float(file, wav.samples.data(), wav.info.frames);
  sf_close(file);
  return wav;
}

}  // namespace carillon
