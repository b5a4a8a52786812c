# SPDX-License-Identifier: BSD-3-Clause
# shellcheck shell=bash
# Settings of Open MPI for tests and small boxes; read with `.` before mpirun. tests/cli and tests/mpi read the same
# lines, so that they stand in one place only: keep to `NAME=value`.
# Run as root (containers), more ranks than cores, ranks that give way while they wait.
export OMPI_ALLOW_RUN_AS_ROOT=1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_MCA_rmaps_base_oversubscribe=1
export OMPI_MCA_hwloc_base_binding_policy=none
export OMPI_MCA_mpi_yield_when_idle=1
