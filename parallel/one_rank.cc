// SPDX-License-Identifier: BSD-3-Clause
// Carom without MPI (CAROM_MPI=OFF).

#include <cstdlib>

#include "engine/base/error.h"
#include "parallel/world.h"

namespace carom {

/// In one of several processes of Open MPI, MPICH or Slurm, each of which would do the same.
std::unique_ptr<Team> start_team(double) {
  for (const std::string name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"})
    if (const char* const size = std::getenv(name.c_str()); size != nullptr && std::atoi(size) > 1)
      throw Error(Failure::deck,
                  std::string("this is one of ")
                      .append(size)
                      .append(" processes (")
                      .append(name)
                      .append("), each of which would do the same, since this carom has no MPI; start it without "
                              "mpirun, or install one with MPI: CMAKE_ARGS=-DCAROM_PORTABLE=OFF pip install "
                              "./io/python; if each process has a deck of its own, unset ")
                      .append(name));
  return nullptr;
}

std::string mpi_version() { return "no MPI (one rank)"; }

}  // namespace carom
