// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h.
#include "engine/search/simd/scan_kernel.h"

namespace carom::kernels {
const ScanKernels avx2{"avx2", 4, {scan<2, 4>, scan<3, 4>}, {scan_two<2, 4>, scan_two<3, 4>}, near, compare, heads};
}
