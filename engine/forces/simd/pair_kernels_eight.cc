// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/simd/pair_kernel.h"
#include "engine/forces/simd/wave_kernel.h"

namespace carom {
template <>
const PairKernels& kernels_of<PairKernels, 8>() {
  static constexpr PairKernels kernels = pair_kernels_of<8>(PairPotentials{});
  return kernels;
}
template <>
const WaveKernels& kernels_of<WaveKernels, 8>() {
  static constexpr WaveKernels kernels = wave_kernels_of<8>();
  return kernels;
}
}  // namespace carom
