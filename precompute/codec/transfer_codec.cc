// SPDX-License-Identifier: AGPL-3.0-or-later
#include "precompute/codec/transfer_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <complex>
#include <vector>

#include "absl/strings/str_format.h"
#include "carillon/v1/transfer.pb.h"
#include "precompute/codec/record_file.h"
#include "proto/cpp/transfer_format.h"

static_assert(std::endian::native == std::endian::little, "arrays are stored little endian");

namespace carillon::precompute {
namespace {

/// Below it lumping and single precision spoil the small real part of the power at the surface.
constexpr double kEfficient = 0.5;

/// The numbers of kTransferArrays.
struct TransferArrays {
  std::vector<double> eigenvalues;
  std::vector<RadiationState> states;
  std::vector<float> power_integrals, normal_energies, power_errors_db, direction_errors_db;
  std::vector<uint32_t> orders, first, harmonics;
  std::vector<std::complex<float>> coefficients;
};

RadiationState StateOf(const ModeRadiation& mode) {
  if (!mode.in_band) return RadiationState::kOutsideBand;
  return mode.computed ? RadiationState::kComputed : RadiationState::kOutOfTime;
}

TransferArrays MakeArrays(const Transfer& transfer, const ModalModel& model) {
  TransferArrays arrays;
  arrays.eigenvalues = model.eigenvalues;
  arrays.first.push_back(0);
  for (const ModeRadiation& mode : transfer.modes) {
    arrays.states.push_back(StateOf(mode));
    arrays.power_integrals.push_back(static_cast<float>(mode.power_integral));
    arrays.normal_energies.push_back(static_cast<float>(mode.normal_energy));
    arrays.power_errors_db.push_back(static_cast<float>(mode.power_error_db));
    arrays.direction_errors_db.push_back(static_cast<float>(mode.direction_error_db));
    arrays.orders.push_back(static_cast<uint32_t>(mode.order));
    arrays.harmonics.insert(arrays.harmonics.end(), mode.index.begin(), mode.index.end());
    arrays.coefficients.insert(arrays.coefficients.end(), mode.value.begin(), mode.value.end());
    arrays.first.push_back(static_cast<uint32_t>(arrays.harmonics.size()));
  }
  return arrays;
}

/// The arrays follow the order of kTransferArrays.
std::array<Bytes, kTransferArrayCount> AllBytes(const TransferArrays& arrays) {
  return {BytesOf(arrays.eigenvalues),     BytesOf(arrays.states),
          BytesOf(arrays.power_integrals), BytesOf(arrays.normal_energies),
          BytesOf(arrays.power_errors_db), BytesOf(arrays.direction_errors_db),
          BytesOf(arrays.orders),          BytesOf(arrays.first),
          BytesOf(arrays.harmonics),       BytesOf(arrays.coefficients)};
}

v1::Vec3 ToProto(const Point& point) {
  v1::Vec3 result;
  result.set_x(point[0]);
  result.set_y(point[1]);
  result.set_z(point[2]);
  return result;
}

v1::RigidBody ToProto(const RigidRadiation& rigid) {
  v1::RigidBody body;
  body.set_volume_m3(rigid.mass.volume_m3);
  *body.mutable_center_of_mass_m() = ToProto(rigid.mass.center_of_mass);
  for (const double value : rigid.mass.inertia) body.add_inertia_kg_m2(value);
  body.mutable_wavenumbers()->Assign(rigid.wavenumbers.begin(), rigid.wavenumbers.end());
  if (rigid.wavenumbers.empty()) return body;
  for (const RigidRadiation::Motion& from : rigid.motions) {
    v1::RigidMotion& motion = *body.add_motions();
    motion.set_radius_m(from.radius_m);
    motion.mutable_strengths()->Assign(from.strengths.begin(), from.strengths.end());
    motion.mutable_power_integrals()->Assign(from.power_integrals.begin(),
                                             from.power_integrals.end());
    motion.set_error_db(from.error_db);
  }
  return body;
}

v1::TransferVerification Verify(const Transfer& transfer) {
  v1::TransferVerification worst;
  for (const ModeRadiation& mode : transfer.modes) {
    if (!mode.computed) continue;
    worst.set_max_residual(std::max(worst.max_residual(), mode.residual));
    worst.set_max_power_error_db(std::max(worst.max_power_error_db(), mode.power_error_db));
    worst.set_max_direction_error_db(
        std::max(worst.max_direction_error_db(), mode.direction_error_db));
    worst.set_max_vertex_count(
        std::max(worst.max_vertex_count(), static_cast<uint32_t>(mode.vertex_count)));
    if (mode.efficiency() < kEfficient) continue;
    worst.set_max_surface_power_db(
        std::max(worst.max_surface_power_db(), std::abs(mode.surface_power_db)));
  }
  return worst;
}

void AddWarnings(const Transfer& transfer, int64_t computed, v1::TransferHeader& header) {
  const int64_t wanted = std::ranges::count_if(transfer.modes, &ModeRadiation::in_band);
  if (computed < wanted) {
    header.add_warnings(absl::StrFormat(
        "the radiation of %d of %d modes was not computed, because the processor time of %g s ran "
        "out; the lowest modes came first, then the loudest",
        wanted - computed, wanted, transfer.settings.budget_cpu_s));
  }
  const double goal_db = transfer.settings.goal_db;
  const int64_t off = std::ranges::count_if(transfer.modes, [&](const ModeRadiation& mode) {
    return mode.computed && mode.power_error_db > goal_db;
  });
  if (off > 0) {
    header.add_warnings(absl::StrFormat(
        "the power of %d modes is estimated to be off by more than the %g dB asked for; allow more "
        "processor time",
        off, goal_db));
  }
}

v1::TransferRecord MakeHeader(const Transfer& transfer, const ModelOrigin& origin,
                              const TransferArrays& arrays) {
  v1::TransferRecord record;
  v1::TransferHeader& header = *record.mutable_header();
  const int64_t computed = std::ranges::count_if(transfer.modes, &ModeRadiation::computed);
  header.set_format_version(kTransferFormatVersion);
  header.set_solver(kSolver);
  *header.mutable_settings() = origin.settings;
  header.set_mesh_digest(origin.mesh_digest);
  header.set_mode_count(static_cast<uint32_t>(transfer.modes.size()));
  header.set_wanted_mode_count(
      static_cast<uint32_t>(std::ranges::count_if(transfer.modes, &ModeRadiation::in_band)));
  header.set_computed_mode_count(static_cast<uint32_t>(computed));
  header.set_speed_ratio(transfer.settings.speed_ratio);
  header.set_sound_speed_m_per_s(transfer.settings.air.sound_speed_m_per_s);
  header.set_air_density_kg_per_m3(transfer.settings.air.density_kg_per_m3);
  *header.mutable_center_m() = ToProto(transfer.center);
  *header.mutable_rigid_body() = ToProto(transfer.rigid);
  header.set_radius_m(transfer.radius_m);
  *header.mutable_verification() = Verify(transfer);
  const TransferSizes sizes{.modes = transfer.modes.size(), .harmonics = arrays.harmonics.size()};
  for (const ArraySpec& spec : kTransferArrays) *header.add_arrays() = DescribeArray(spec, sizes);
  header.mutable_transfer_settings()->set_accuracy_db(transfer.settings.goal_db);
  header.mutable_transfer_settings()->set_budget_s(transfer.settings.budget_cpu_s);
  header.set_cpu_s(transfer.cpu_s);
  AddWarnings(transfer, computed, header);
  return record;
}

}  // namespace

absl::Status WriteTransfer(const std::string& path, const Transfer& transfer,
                           const StoredModel& stored) {
  const TransferArrays arrays = MakeArrays(transfer, stored.model);
  return WriteRecordFile(path, MakeHeader(transfer, stored.origin, arrays), AllBytes(arrays));
}

}  // namespace carillon::precompute
