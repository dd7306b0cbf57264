// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "carillon/client.h"

namespace carillon::client {

static_assert(std::endian::native == std::endian::little, "samples come in little endian");

/// Converts the messages of a stream to blocks. A block is valid until the next call of Read().
class BlockReader {
 public:
  void SetFormat(const v1::AudioFormat& format) {
    block_.sample_rate_hz = format.sample_rate_hz();
    block_.channel_count = format.channel_count();
    encoding_ = format.encoding();
  }

  const AudioBlock& Read(const v1::AudioBlock& message, uint64_t lost_frame_count) {
    if (encoding_ == v1::AUDIO_ENCODING_INT16) {
      ReadIntegers(message.samples());
    } else {
      samples_.resize(message.samples().size() / sizeof(float));
      std::memcpy(samples_.data(), message.samples().data(), samples_.size() * sizeof(float));
    }
    block_.first_frame = message.first_frame();
    block_.lost_frame_count = lost_frame_count;
    block_.samples = samples_;
    return block_;
  }

 private:
  void ReadIntegers(const std::string& bytes) {
    constexpr float kFullScale = 32767;
    std::vector<int16_t> integers(bytes.size() / sizeof(int16_t));
    std::memcpy(integers.data(), bytes.data(), integers.size() * sizeof(int16_t));
    samples_.assign(integers.begin(), integers.end());
    for (float& sample : samples_) sample /= kFullScale;
  }

  std::vector<float> samples_;
  v1::AudioEncoding encoding_ = v1::AUDIO_ENCODING_UNSPECIFIED;
  AudioBlock block_;
};

}  // namespace carillon::client
