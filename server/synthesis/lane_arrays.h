// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>

namespace carillon {

/// A zeroed array aligned for the widest vector.
template <typename T>
class LaneArray {
 public:
  explicit LaneArray(size_t size = 0)
      : values_(static_cast<T*>(::operator new(size * sizeof(T), kAlignment))) {
    std::uninitialized_fill_n(values_.get(), size, T{});
  }
  T* data() noexcept { return values_.get(); }
  const T* data() const noexcept { return values_.get(); }
  T& operator[](size_t i) noexcept { return values_[i]; }

 private:
  static constexpr std::align_val_t kAlignment{64};
  struct Delete {
    void operator()(T* values) const noexcept { ::operator delete(values, kAlignment); }
  };
  std::unique_ptr<T[], Delete> values_;
};

/// The figures of a bank's modes, one lane each. First the modes in the order of their columns,
/// then the companions, then silent lanes up to a whole vector.
struct LaneArrays {
  explicit LaneArrays(size_t lane_count, size_t column_count);

  // State: double between blocks, float within.
  LaneArray<double> re, im;
  LaneArray<float> newborn_re, newborn_im;  // of what was struck in this block
  // q and q^N for a block of N frames.
  LaneArray<float> step_re, step_im;
  LaneArray<double> block_re, block_im;
  // From modal impulse to state: -i exp(i phase) c / omega_d with all scales.
  LaneArray<float> gain_re, gain_im;
  // Per frame of lead: sigma and omega_d over the sample rate. Per tau^2: real and imaginary part
  // of s^2/2.
  LaneArray<float> lead_re, lead_im, tau_re, tau_im;
  LaneArray<uint32_t> column;  // within the range of columns projected
  // Of the strike under way: modal impulses by column, additions to the state by lane.
  LaneArray<float> modal_impulse, added_re, added_im;
};

}  // namespace carillon
