#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Times of runs on one rank over those on two, in alternating runs: the median and all ratios. `flight` are gases in free
# flight, `forces` the Lennard-Jones melt, the Yukawa fluid, the spring lattice and electrolytes; `halves` are gases of
# half of the spheres, two on one rank each at one time instead of one on two ranks: what two ranks could reach.
#
#     tests/benchmarks/two_ranks.sh build/release/io/carom [flight|forces|halves] [PAIRS=5] [RANKS=2]
set -euo pipefail
carom=$(realpath "$1") what=${2:-flight} pairs=${3:-5} ranks=${4:-2}
cd "$(dirname "$0")/../.."
# shellcheck source=tools/mpi-env.sh
. tools/mpi-env.sh
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT
declare -A decks

gas() {
  echo "inputs/hard-sphere-fluid.toml --set particles.0.count=$1 --set placement.packing_fraction=$2" \
    "--set run.collisions=$((20 * $1)) --set run.end_time=1e9 --set output.events=false"
}
ions() {
  echo "inputs/electrolyte-ewald.toml --set particles.0.count=$(($1 / 2)) --set particles.1.count=$(($1 / 2))" \
    "--set system.box=[$2,$2,$2] --set integrator.type=$3 --set run.steps=$4"
}
flight=("20000 0.30" "200000 0.30" "1000000 0.30" "200000 0.10" "200000 0.49")
forces=("melt" "yukawa" "lattice" "edda, 10976 ions" "psa, 108000 ions")
decks["melt"]="inputs/lennard-jones.toml --set particles.count=32000 --set system.box=[33.5919,33.5919,33.5919]
  --set run.steps=400 --set run.end_time=1e9"
decks["yukawa"]="inputs/yukawa-fluid.toml --set run.end_time=0.5"
decks["lattice"]="inputs/spring-lattice.toml --set particles.count=1000000 --set run.steps=20"
decks["edda, 10976 ions"]=$(ions 10976 49.13 edda 5)
decks["psa, 108000 ions"]=$(ions 108000 105.32 psa 4)

# run RANKS NAME DECK…: prints the seconds that run.log gives
run() {
  mpirun -n "$1" "$carom" run "${@:3}" --quiet -o "$runs/$2" --set output.frame_interval=1e9 --set output.thermo_interval=1e9
  awk '/^total / { print $2 }' "$runs/$2/run.log"
  rm -r "${runs:?}/$2"
}

# pair NAME: prints the two times
pair() {
  local half spheres filled
  read -r spheres filled <<<"$1"
  # shellcheck disable=SC2046,SC2086  # a deck is a list of words
  if [ "$what" = halves ]; then
    half=$(gas $((spheres / 2)) "$filled")
    echo "$(run 1 whole $(gas "$spheres" "$filled")) $({ run 1 left $half & run 1 right $half; wait; } | sort -g | tail -1)"
  else
    [ "$what" = flight ] && decks[$1]=$(gas "$spheres" "$filled")
    echo "$(run 1 one ${decks[$1]}) $(run "$ranks" many ${decks[$1]})"
  fi
}

cases=("${flight[@]}")
[ "$what" = forces ] && cases=("${forces[@]}")
for case in "${cases[@]}"; do
  for ((k = 0; k < pairs; ++k)); do pair "$case"; done | awk '{ print $1 / $2, $1, $2 }' | sort -g | awk -v what="$case" \
    '{ all[NR] = $1; times[NR] = $2 " s : " $3 " s" }
     END { m = int((NR + 1) / 2); printf "%s: %.2f, %s (", what, all[m], times[m]
           for (k = 1; k <= NR; ++k) printf " %.2f", all[k]; print " )" }'
done
