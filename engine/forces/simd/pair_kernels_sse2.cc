// SPDX-License-Identifier: BSD-3-Clause
#include "engine/forces/simd/pair_kernel.h"

namespace carom::kernels {
constinit const PairKernels pairs_sse2 = kernels_of<2>("sse2", PairPotentials{});
}  // namespace carom::kernels
