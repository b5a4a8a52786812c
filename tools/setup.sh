# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash disable=SC1091,SC2086
# Sourced by tools/run, tools/test and tools/renew-regression: from a bare Debian 12 to a built Carom.
#
#   source tools/setup.sh
#   install_packages [LIST…]        # the packages of these lists that are missing; default: build-packages.txt and packages.txt
#   build release carom             # a CMake preset and its targets; none = all
#
# Both return at once where there is nothing to do. Messages go to standard error.

carom_root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
if [ -f "$carom_root/tools/mpi-env.sh" ]; then source "$carom_root/tools/mpi-env.sh"; fi

# Prints the packages of lists that are not installed, one a line.
missing_packages() {
  local wanted
  wanted=$(grep -hv '^#' "$@")
  # dpkg-query complains about names it has never seen; these are missing like the others.
  comm -23 <(sort <<<"$wanted") \
    <(dpkg-query -W -f '${db:Status-Status} ${Package}\n' $wanted 2>/dev/null | sed -n 's/^installed //p' | sort -u)
}

install_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "Not a Debian system: taking the packages of tools/build-packages.txt and tools/packages.txt for granted." >&2
    return
  fi
  local missing as_root=()
  if [ $# = 0 ]; then set -- "$carom_root"/tools/{build-packages,packages}.txt; fi
  missing=$(missing_packages "$@" | tr '\n' ' ')
  if [ -z "$missing" ]; then return; fi
  if [ "$(id -u)" != 0 ]; then
    if ! sudo -n true 2>/dev/null; then
      echo "Carom needs packages that only root can install. Run one of these, then call again:" >&2
      printf "  %s 'apt-get update && apt-get install --yes --no-install-recommends ${missing% }'\n" 'sudo sh -c' 'su -c' >&2
      exit 1
    fi
    as_root=(sudo -n)
  fi
  echo "Installing: $missing" >&2
  "${as_root[@]}" apt-get update >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends $missing >&2
}

# cmake ARGUMENT…; a new directory gets Ninja, since make, CMake's own choice, need not be installed.
configure() {
  if command -v ninja >/dev/null; then local -x CMAKE_GENERATOR=${CMAKE_GENERATOR:-Ninja}; fi
  cmake "$@" >&2
}

# build PRESET [TARGET…]: sets build_dir.
build() {
  local preset=$1
  shift
  build_dir=$carom_root/build/$preset
  # A directory that was once generated looks after itself: the build runs CMake again when its files have changed.
  if [ ! -f "$build_dir/build.ninja" ] && [ ! -f "$build_dir/Makefile" ]; then
    (cd "$carom_root" && configure --preset "$preset")
  fi
  cmake --build "$build_dir" --parallel "$(nproc)" ${1:+--target "$@"} >&2
}
