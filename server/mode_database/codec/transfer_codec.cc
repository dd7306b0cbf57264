// SPDX-License-Identifier: Apache-2.0
#include "server/mode_database/codec/transfer_codec.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <fstream>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "proto/cpp/error_reason.h"
#include "proto/cpp/status_macros.h"
#include "server/base/xxh3.h"

namespace carillon {
namespace {

constexpr uint64_t kMostArrayBytes = uint64_t{1} << 30;

/// Indices into kTransferArrays.
enum : size_t {
  kEigenvalues,
  kStates,
  kPowerIntegrals,
  kNormalEnergies,
  kFirst = 7,
  kHarmonics,
  kCoefficients
};
static_assert(std::string_view(kTransferArrays[kFirst].name) == "first");
static_assert(std::string_view(kTransferArrays[kHarmonics].name) == "harmonics");
static_assert(std::string_view(kTransferArrays[kCoefficients].name) == "coefficients");
/// The least index l^2 + l + m of an order that no transfer has: 600 harmonics around a body.
constexpr uint32_t kLeastBadHarmonic = 601 * 601;

absl::Status Malformed(absl::string_view what) {
  return Refusal(absl::StatusCode::kInvalidArgument, "TRANSFER_MALFORMED",
                 absl::StrCat("the records of the transfer are damaged: ", what,
                              "; write it anew with carillon-precompute or by an export"));
}

absl::Status ForEachRecord(const std::string& bytes,
                           absl::FunctionRef<absl::Status(const v1::TransferRecord&)> on_record) {
  google::protobuf::io::ArrayInputStream stream(bytes.data(), static_cast<int>(bytes.size()));
  v1::TransferRecord record;
  bool at_end = false;
  while (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&record, &stream, &at_end)) {
    RETURN_IF_ERROR(on_record(record));
    record.Clear();
  }
  return at_end ? absl::OkStatus() : Malformed("it ends within a record");
}

TransferSizes SizesOf(const v1::TransferHeader& header) {
  TransferSizes sizes{.modes = header.mode_count(), .harmonics = 0};
  for (const v1::ArrayDescriptor& array : header.arrays()) {
    if (array.name() == kTransferArrays[kHarmonics].name && array.shape_size() == 1) {
      sizes.harmonics = array.shape(0);
    }
  }
  return sizes;
}

/// The bytes of an array; more than kMostArrayBytes: it has no type or is too large.
uint64_t ArrayBytes(const v1::ArrayDescriptor& array) {
  uint64_t bytes = array.type() == v1::ELEMENT_TYPE_FLOAT64 ? sizeof(double) : sizeof(float);
  if (array.type() == v1::ELEMENT_TYPE_UNSPECIFIED) return kMostArrayBytes + 1;
  for (const uint64_t size : array.shape()) {
    if (size > kMostArrayBytes || bytes * size > kMostArrayBytes) return kMostArrayBytes + 1;
    bytes *= size;
  }
  return bytes;
}

bool IsPositive(double value) { return std::isfinite(value) && value > 0; }

template <typename T>
bool AreFinite(const std::vector<T>& values) {
  return std::all_of(values.begin(), values.end(), [](T value) { return std::isfinite(value); });
}

/// Gives each mode that was not computed the efficiency k^2 I / (normal energy) of the nearest one
/// that was.
void EstimateMissing(const std::vector<double>& eigenvalues, const std::vector<uint32_t>& states,
                     const std::vector<float>& normal_energies, std::vector<float>& integrals) {
  const auto computed = [&](size_t m) {
    return states[m] == static_cast<uint32_t>(RadiationState::kComputed) && normal_energies[m] > 0;
  };
  const size_t count = eigenvalues.size();
  for (size_t m = 0; m < count; ++m) {
    if (states[m] == static_cast<uint32_t>(RadiationState::kComputed)) continue;
    std::optional<size_t> nearest;
    for (size_t i = 0; i < count; ++i) {
      const auto distance = [&](size_t n) {
        return std::abs(std::log(eigenvalues[n] / eigenvalues[m]));
      };
      if (computed(i) && (!nearest || distance(i) < distance(*nearest))) nearest = i;
    }
    if (!nearest) continue;
    integrals[m] =
        static_cast<float>(double{integrals[*nearest]} * eigenvalues[*nearest] /
                           normal_energies[*nearest] * normal_energies[m] / eigenvalues[m]);
  }
}

/// Whether each mode's harmonics ascend and are of possible orders.
bool AreHarmonics(const std::vector<uint32_t>& first, const std::vector<uint32_t>& harmonics) {
  for (size_t m = 0; m + 1 < first.size(); ++m) {
    for (size_t i = first[m]; i < first[m + 1]; ++i) {
      if (harmonics[i] >= kLeastBadHarmonic) return false;
      if (i > first[m] && harmonics[i] <= harmonics[i - 1]) return false;
    }
  }
  return true;
}

/// Whether the transfer says how a body radiates that moves freely as a whole.
bool HasRigidBody(const v1::TransferHeader& header) {
  return header.settings().fixtures_size() == 0 && header.rigid_body().motions_size() > 0;
}

bool IsPhysical(const v1::RigidBody& body) {
  bool good = body.motions_size() == 6 && body.inertia_kg_m2_size() == 6 &&
              IsPositive(body.volume_m3()) && std::isfinite(body.center_of_mass_m().x()) &&
              std::isfinite(body.center_of_mass_m().y()) &&
              std::isfinite(body.center_of_mass_m().z());
  const auto finite = [](double value) { return std::isfinite(value); };
  good = good && std::ranges::all_of(body.inertia_kg_m2(), finite);
  for (const v1::RigidMotion& motion : body.motions()) {
    good = good && std::isfinite(motion.radius_m()) && motion.radius_m() >= 0 &&
           motion.strengths_size() == 9 && std::ranges::all_of(motion.strengths(), finite);
  }
  return good;
}

RigidRadiation RigidOf(const v1::RigidBody& body) {
  RigidRadiation rigid{
      .volume_m3 = body.volume_m3(),
      .center_of_mass_m = {body.center_of_mass_m().x(), body.center_of_mass_m().y(),
                           body.center_of_mass_m().z()}};
  std::ranges::copy(body.inertia_kg_m2(), rigid.inertia_kg_m2.begin());
  for (int i = 0; i < 6; ++i) {
    RigidRadiation::Motion& motion = rigid.motions[static_cast<size_t>(i)];
    motion.radius_m = body.motions(i).radius_m();
    std::ranges::copy(body.motions(i).strengths(), motion.strengths.begin());
  }
  return rigid;
}

/// Turns the coefficients c_lm into those of the far pattern, of unit power.
void SetPatterns(const std::vector<float>& coefficients, Transfer& transfer) {
  const size_t count = transfer.harmonics.size();
  transfer.pattern_re.resize(count);
  transfer.pattern_im.resize(count);
  for (size_t m = 0; m + 1 < transfer.first.size(); ++m) {
    const size_t end = transfer.first[m + 1];
    double square = 0;
    for (size_t i = 2 * transfer.first[m]; i < 2 * end; ++i) {
      square += double{coefficients[i]} * coefficients[i];
    }
    const double scale = square > 0 ? 1 / std::sqrt(square) : 0;
    for (size_t i = transfer.first[m]; i < end; ++i) {
      const auto order = static_cast<int>(std::sqrt(static_cast<double>(transfer.harmonics[i])));
      constexpr std::complex<double> kTurns[] = {{1, 0}, {0, -1}, {-1, 0}, {0, 1}};  // (-i)^n
      const std::complex<double> pattern =
          scale * kTurns[(order + 1) % 4] *
          std::complex<double>(coefficients[2 * i], coefficients[2 * i + 1]);
      transfer.pattern_re[i] = static_cast<float>(pattern.real());
      transfer.pattern_im[i] = static_cast<float>(pattern.imag());
    }
  }
}

}  // namespace

absl::StatusOr<StoredTransfer> StoredTransfer::Parse(std::string bytes) {
  StoredTransfer transfer;
  transfer.bytes_ = std::move(bytes);
  RETURN_IF_ERROR(transfer.ParseRecords());
  RETURN_IF_ERROR(transfer.CheckNumbers());
  return transfer;
}

absl::StatusOr<StoredTransfer> StoredTransfer::ReadFile(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return Refusal(absl::StatusCode::kNotFound, "FILE_NOT_FOUND",
                   absl::StrCat(file.string(), " cannot be read: see its name and rights"));
  }
  return Parse({std::istreambuf_iterator<char>(in), {}});
}

absl::Status StoredTransfer::ParseRecords() {
  bool begun = false;
  RETURN_IF_ERROR(ForEachRecord(bytes_, [&](const v1::TransferRecord& record) -> absl::Status {
    if (begun) {
      return record.has_chunk() ? TakeChunk(record.chunk())
                                : Malformed("a record after the header is not a chunk");
    }
    if (!record.has_header()) return Malformed("its first record is not a header");
    begun = true;
    header_ = record.header();
    return CheckHeader();
  }));
  if (!begun) return Malformed("it is empty");
  for (size_t i = 0; i < arrays_.size(); ++i) {
    const v1::ArrayDescriptor& array = header_.arrays(static_cast<int>(i));
    if (arrays_[i].size() != ArrayBytes(array)) {
      return Malformed(absl::StrCat("it ends within array \"", array.name(), "\""));
    }
  }
  return absl::OkStatus();
}

absl::Status StoredTransfer::CheckHeader() {
  if (header_.format_version() != kTransferFormatVersion) {
    return Malformed(absl::StrCat("it has format version ", header_.format_version()));
  }
  if (!IsPositive(header_.speed_ratio()) || !IsPositive(header_.sound_speed_m_per_s()) ||
      !IsPositive(header_.air_density_kg_per_m3()) || header_.mode_count() == 0) {
    return Malformed("its header has no modes, or a speed or density that is not above zero");
  }
  for (const v1::ArrayDescriptor& array : header_.arrays()) {
    if (ArrayBytes(array) > kMostArrayBytes) {
      return Malformed(absl::StrCat("array \"", array.name(), "\" has no type or too much"));
    }
  }
  arrays_.resize(static_cast<size_t>(header_.arrays_size()));
  return FindArrays();
}

absl::Status StoredTransfer::FindArrays() {
  const TransferSizes sizes = SizesOf(header_);
  for (size_t i = 0; i < kReadArrayCount; ++i) {
    const v1::ArrayDescriptor wanted = DescribeArray(kTransferArrays[i], sizes);
    const auto found = std::find_if(
        header_.arrays().begin(), header_.arrays().end(),
        [&](const v1::ArrayDescriptor& array) { return array.name() == wanted.name(); });
    if (found == header_.arrays().end() ||
        found->SerializeAsString() != wanted.SerializeAsString()) {
      return Malformed(
          absl::StrCat("array \"", wanted.name(), "\" is missing or of another type or shape"));
    }
    place_[i] = static_cast<size_t>(found - header_.arrays().begin());
  }
  return absl::OkStatus();
}

absl::Status StoredTransfer::TakeChunk(const v1::ModalModelChunk& chunk) {
  if (chunk.array() >= arrays_.size()) return Malformed("a chunk is of no array");
  std::string& array = arrays_[chunk.array()];
  const v1::ArrayDescriptor& descriptor = header_.arrays(static_cast<int>(chunk.array()));
  const std::string& name = descriptor.name();
  const uint64_t whole = ArrayBytes(descriptor);
  if (chunk.offset() != array.size() || chunk.data().size() > whole - array.size()) {
    return Malformed(absl::StrCat("a chunk of array \"", name, "\" is out of order or too long"));
  }
  if (Xxh3(chunk.data()) != chunk.xxh3()) {
    return Refusal(
        absl::StatusCode::kDataLoss, "TRANSFER_CORRUPT",
        absl::StrCat("the hash of array \"", name, "\" at byte ", chunk.offset(),
                     " of a transfer is wrong, so its bytes have changed since they were "
                     "computed: compute it again, or import it from a copy"));
  }
  array.append(chunk.data());
  return absl::OkStatus();
}

absl::Status StoredTransfer::CheckNumbers() const {
  const TransferSizes sizes = SizesOf(header_);
  bool good = true;
  for (size_t i = 0; i < kReadArrayCount; ++i) {
    good =
        good && (kTransferArrays[i].type != v1::ELEMENT_TYPE_FLOAT32 || AreFinite(Array<float>(i)));
  }
  const std::vector<double> eigenvalues = Eigenvalues();
  good = good && AreFinite(eigenvalues) && eigenvalues.front() > 0 &&
         std::ranges::is_sorted(eigenvalues);
  for (const size_t i : {kPowerIntegrals, kNormalEnergies}) {
    good = good && std::ranges::all_of(Array<float>(i), [](float value) { return value >= 0; });
  }
  const std::vector<uint32_t> first = Array<uint32_t>(kFirst);
  good = good && first.front() == 0 && first.back() == sizes.harmonics &&
         std::ranges::is_sorted(first) && AreHarmonics(first, Array<uint32_t>(kHarmonics));
  good = good && (!HasRigidBody(header_) || IsPhysical(header_.rigid_body()));
  if (good) return absl::OkStatus();
  return Malformed("a number is not finite, out of range or out of order");
}

template <typename T>
std::vector<T> StoredTransfer::Array(size_t index) const {
  const std::string& bytes = arrays_[place_[index]];
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

std::vector<double> StoredTransfer::Eigenvalues() const { return Array<double>(kEigenvalues); }

Transfer StoredTransfer::Decode() const {
  Transfer transfer{
      .speed_ratio = header_.speed_ratio(),
      .sound_speed_m_per_s = header_.sound_speed_m_per_s(),
      .air_density_kg_per_m3 = header_.air_density_kg_per_m3(),
      .power_integrals = Array<float>(kPowerIntegrals),
      .center_m = {header_.center_m().x(), header_.center_m().y(), header_.center_m().z()},
      .radius_m = header_.radius_m(),
      .first = Array<uint32_t>(kFirst),
      .harmonics = Array<uint32_t>(kHarmonics)};
  SetPatterns(Array<float>(kCoefficients), transfer);
  EstimateMissing(Eigenvalues(), Array<uint32_t>(kStates), Array<float>(kNormalEnergies),
                  transfer.power_integrals);
  if (HasRigidBody(header_)) transfer.rigid = RigidOf(header_.rigid_body());
  return transfer;
}

std::vector<v1::TransferRecord> StoredTransfer::Records() const {
  std::vector<v1::TransferRecord> records;
  ForEachRecord(bytes_, [&](const v1::TransferRecord& record) {
    records.push_back(record);
    return absl::OkStatus();
  }).IgnoreError();
  return records;
}

std::string Delimited(const v1::TransferRecord& record) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::util::SerializeDelimitedToZeroCopyStream(record, &stream);
  }
  return bytes;
}

}  // namespace carillon
