// SPDX-License-Identifier: BSD-3-Clause
// The ranks of a Carom without MPI: this test is linked with parallel/one_rank.cc.
#include <gtest/gtest.h>

#include <cstdlib>

#include "engine/base/error.h"
#include "parallel/world.h"

namespace carom::one_rank_test {

TEST(OneRank, RunsTheWork) {
  const World ranks;
  EXPECT_EQ(ranks.size(), 1);
  EXPECT_EQ(ranks.rank(), 0);
  EXPECT_EQ(ranks.on_all([] { return 7; }), 7);
  EXPECT_EQ(ranks.on_first([]() -> int { throw Error(Failure::numerical, "a numerical failure"); }), 4);
  EXPECT_EQ(mpi_version(), "no MPI (one rank)");
}

TEST(OneRank, OneOfSeveralProcessesIsAnError) {
  for (const char* const name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"}) {
    setenv(name, "1", 1);
    EXPECT_NO_THROW(World());
    setenv(name, "4", 1);
    try {
      World();
      ADD_FAILURE() << name;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(std::string("one of 4 processes (") + name), std::string::npos) << e.what();
      EXPECT_EQ(e.exit_code(), 2);
    }
    unsetenv(name);
  }
}

}  // namespace carom::one_rank_test
