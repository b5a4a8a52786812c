#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Collision rates of free flight on two ranks over those on one, in alternating runs: the median and all ratios.
#
#     tests/benchmarks/two_ranks.sh build/release/io/carom [PAIRS=5] [RANKS=2]
set -euo pipefail
carom=$1 pairs=${2:-5} ranks=${3:-2}
cd "$(dirname "$0")/../.."
# shellcheck source=tools/mpi-env.sh
. tools/mpi-env.sh
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

# rate RANKS SPHERES PACKING_FRACTION: pair collisions per second of wall time
rate() {
  mpirun -n "$1" "$carom" run inputs/hard-sphere-fluid.toml --quiet -o "$runs/run" \
    --set particles.0.count="$2" --set placement.packing_fraction="$3" --set run.collisions=$((20 * $2)) \
    --set run.end_time=1e9 --set output.events=false --set output.frame_interval=1e9 --set output.thermo_interval=1e9
  grep -oE '[0-9.e+]+ pair collisions/s' "$runs/run/run.log" | cut -d' ' -f1
  rm -r "$runs/run"
}

for case in "20000 0.30" "200000 0.30" "1000000 0.30" "200000 0.10" "200000 0.49"; do
  read -r spheres filled <<<"$case"
  for ((k = 0; k < pairs; ++k)); do
    echo "$(rate 1 "$spheres" "$filled") $(rate "$ranks" "$spheres" "$filled")"
  done | awk '{ print $2 / $1 }' | sort -n | awk -v what="$spheres spheres, packing fraction $filled" \
    '{ all[NR] = $1 } END { printf "%s: %.2f (", what, all[int((NR + 1) / 2)]; for (k = 1; k <= NR; ++k) printf " %.2f", all[k]; print " )" }'
done
