// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/simd/pair_kernel.h"

namespace carom::kernels {
constinit const PairKernels pairs_avx2 = kernels_of<4>("avx2", PairPotentials{});
}  // namespace carom::kernels
