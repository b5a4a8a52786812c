#include "engine/forces/pair_formulas.h"

namespace carom::kernels {
constinit const PairKernels pairs_avx512 = kernels_of<8>("avx512", PairPotentials{});
}  // namespace carom::kernels
