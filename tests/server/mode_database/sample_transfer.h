// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <iterator>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include "proto/cpp/transfer_format.h"
#include "server/base/xxh3.h"
#include "server/mode_database/codec/modal_model.h"
#include "server/mode_database/codec/transfer_codec.h"

namespace carillon {

/// What a sample transfer says of its modes.
struct SampleRadiation {
  double speed_ratio = 10;
  std::vector<uint32_t> states{};  ///< empty: all computed
  std::vector<float> power_integrals{};
  std::vector<float> normal_energies{};  ///< empty: all one
  std::vector<uint32_t> harmonics{};     ///< one of each mode; empty: l = 0
  v1::RigidBody rigid{};
  bool fixed = false;  ///< the model has a boundary condition
};

template <typename T>
std::string BytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline v1::TransferHeader SampleTransferHeader(uint32_t mode_count, double speed_ratio) {
  v1::TransferHeader header;
  header.set_format_version(1);
  header.set_mode_count(mode_count);
  header.set_wanted_mode_count(mode_count);
  header.set_computed_mode_count(mode_count);
  header.set_speed_ratio(speed_ratio);
  header.set_sound_speed_m_per_s(343);
  header.set_air_density_kg_per_m3(1.204);
  header.set_radius_m(0.1);
  header.mutable_transfer_settings()->set_accuracy_db(2);
  header.mutable_transfer_settings()->set_budget_s(20);
  for (const ArraySpec& spec : kTransferArrays) {
    *header.add_arrays() =
        DescribeArray(spec, TransferSizes{.modes = mode_count, .harmonics = mode_count});
  }
  return header;
}

/// The bytes of an array of zeros.
inline std::string Zeros(const TransferSizes& sizes, size_t array) {
  const ArraySpec& spec = kTransferArrays[array];
  uint64_t bytes = spec.type == v1::ELEMENT_TYPE_FLOAT64 ? 8 : 4;
  for (const char dimension : std::string_view(spec.shape)) bytes *= sizes.Of(dimension);
  return std::string(bytes, '\0');
}

/// A ball of 5 cm that translates.
inline v1::RigidBody SampleRigidBody() {
  v1::RigidBody body;
  body.set_volume_m3(5.236e-4);
  for (const double moment : {5.2e-7, 5.2e-7, 5.2e-7, 0.0, 0.0, 0.0}) {
    body.add_inertia_kg_m2(moment);
  }
  for (const int harmonic : {3, 1, 2, 0, 0, 0}) {
    v1::RigidMotion& motion = *body.add_motions();
    motion.set_radius_m(0.05);
    for (int i = 0; i < 9; ++i) motion.add_strengths(harmonic > 0 && i == harmonic ? 2.05 : 0);
  }
  return body;
}

/// The stored form of a transfer of `model`, each mode with one harmonic.
inline std::string SampleTransferBytes(const ModalModel& model, SampleRadiation radiation) {
  const auto modes = static_cast<uint32_t>(model.mode_count());
  if (radiation.states.empty()) radiation.states.assign(modes, 1);
  if (radiation.normal_energies.empty()) radiation.normal_energies.assign(modes, 1);
  std::vector<uint32_t> first(size_t{1} + modes);
  std::iota(first.begin(), first.end(), 0U);
  const std::string errors = BytesOf(std::vector(modes, 0.5F));
  const std::string zeros = BytesOf(std::vector(modes, 0U));
  if (radiation.harmonics.empty()) radiation.harmonics.assign(modes, 0);
  const std::string arrays[] = {BytesOf(model.eigenvalues),
                                BytesOf(radiation.states),
                                BytesOf(radiation.power_integrals),
                                BytesOf(radiation.normal_energies),
                                errors,
                                errors,
                                zeros,
                                BytesOf(first),
                                BytesOf(radiation.harmonics),
                                BytesOf(std::vector(size_t{2} * modes, 1.0F))};
  v1::TransferRecord record;
  *record.mutable_header() = SampleTransferHeader(modes, radiation.speed_ratio);
  *record.mutable_header()->mutable_rigid_body() = radiation.rigid;
  if (radiation.fixed) record.mutable_header()->mutable_settings()->add_fixtures();
  const TransferSizes all_sizes{.modes = modes, .harmonics = modes};
  std::string all = Delimited(record);
  for (uint32_t i = 0; i < kTransferArrayCount; ++i) {
    const std::string data = i < std::size(arrays) ? arrays[i] : Zeros(all_sizes, i);
    if (data.empty()) continue;
    v1::ModalModelChunk& chunk = *record.mutable_chunk();
    chunk.set_array(i);
    chunk.set_data(data);
    chunk.set_xxh3(Xxh3(data));
    all += Delimited(record);
  }
  return all;
}

inline StoredTransfer SampleTransfer(const ModalModel& model, const SampleRadiation& radiation) {
  return *StoredTransfer::Parse(SampleTransferBytes(model, radiation));
}

}  // namespace carillon
