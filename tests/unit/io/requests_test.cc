// SPDX-License-Identifier: BSD-3-Clause
// Requests to a run by signals and by the clock.

#include "io/command/requests.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace carom::requests_test {
namespace {

TEST(Requests, ASignalAsksForOneCheckpoint) {
  Communicator alone;
  Requests requests({});
  EXPECT_FALSE(requests.now(alone).checkpoint);
  std::raise(SIGUSR1);
  for (int look = 0; look < 2; ++look) {
    const auto asked = requests.now(alone);
    EXPECT_TRUE(asked.checkpoint);
    EXPECT_FALSE(asked.stop);
  }
  requests.checkpoint_is_written();
  EXPECT_FALSE(requests.now(alone).checkpoint);
}

TEST(Requests, CheckpointsAreAnIntervalApart) {
  Communicator alone;
  Requests requests({});
  requests.set_interval(1.0);
  while (!requests.now(alone).checkpoint) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_TRUE(requests.now(alone).checkpoint);
  const auto written = std::chrono::steady_clock::now();
  requests.checkpoint_is_written();
  const bool asked = requests.now(alone).checkpoint;
  EXPECT_TRUE(!asked || std::chrono::steady_clock::now() - written >= std::chrono::seconds(1));
}

/// The wall time counts from the start of the run, not from its last checkpoint. A run that must stop writes a
/// checkpoint.
TEST(Requests, TheWallTimeEndsTheRun) {
  Communicator alone;
  EXPECT_FALSE(Requests(1e9).stop_here(alone));
  Requests requests(0.1);
  for (int looks = 0; looks < 1000 && !requests.stop_here(alone); ++looks) {
    requests.checkpoint_is_written();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(requests.stop_here(alone));
  EXPECT_TRUE(requests.now(alone).stop);
  EXPECT_TRUE(requests.now(alone).checkpoint);
  EXPECT_EQ(requests.reason(), "--max-wall");
}

TEST(Requests, ASignalThatIsIgnoredStaysIgnored) {  // as under nohup
  Communicator alone;
  std::signal(SIGHUP, SIG_IGN);
  Requests requests({});
  std::raise(SIGHUP);
  EXPECT_FALSE(requests.now(alone).stop);
  std::raise(SIGTERM);
  EXPECT_TRUE(requests.now(alone).stop);
  EXPECT_EQ(requests.reason(), "SIGTERM");
}

}  // namespace
}  // namespace carom::requests_test
