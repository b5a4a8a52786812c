// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/simd/pair_kernel.h"

namespace carom::kernels {
constinit const PairKernels pairs_avx512 = kernels_of<8>("avx512", PairPotentials{});
}  // namespace carom::kernels
