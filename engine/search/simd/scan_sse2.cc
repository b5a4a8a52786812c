// SPDX-License-Identifier: BSD-3-Clause
// See scan_kernel.h.
#include "engine/search/simd/scan_kernel.h"

namespace carom::kernels {
const ScanKernels sse2{"sse2", 4, {scan<2, 2>, scan<3, 2>}, {scan_two<2, 2>, scan_two<3, 2>}, near, compare, heads};
}
