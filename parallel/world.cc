// SPDX-License-Identifier: BSD-3-Clause
#include "parallel/world.h"

#include <cstdio>
#include <exception>
#include <new>

#include "engine/base/error.h"

namespace carom {

namespace {

Outcome outcome_of(const std::function<int()>& work) {
  try {
    return {work()};
  } catch (const RankFailure&) {
    return {.code = kFault, .left = true};
  } catch (const SilentRanks& e) {
    return {.code = kFault, .failure = e.what(), .left = true};
  } catch (const Error& e) {
    return {e.exit_code(), e.what()};
  } catch (const std::bad_alloc&) {
    return {kFault, "out of memory"};
  } catch (const std::exception& e) {
    return {kFault, std::string("internal error: ") + e.what()};
  }
}

}  // namespace

int World::on_all(const std::function<int()>& work) const {
  const Outcome outcome = outcome_of(work);
  if (size() > 1) return team_->finish(outcome, false);
  if (!outcome.failure.empty()) std::fprintf(stderr, "%s\n", outcome.failure.c_str());
  return outcome.code;
}

int World::on_first(const std::function<int()>& work) const {
  if (size() == 1) return on_all(work);
  return team_->finish(rank() == 0 ? outcome_of(work) : Outcome{}, true);
}

}  // namespace carom
