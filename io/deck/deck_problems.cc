// SPDX-License-Identifier: BSD-3-Clause
#include "io/deck/deck_problems.h"

#include <algorithm>
#include <tuple>

#include "io/deck/deck.h"

namespace carom {
namespace {

/// Edits that turn a into b: insert, delete, replace a letter or swap two neighbours.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replace = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replace});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::string Place::text() const {
  if (line == 0) return source;
  return source + ":" + std::to_string(line) + ":" + std::to_string(column);
}

void Problems::error(const Place& place, const std::string& what, const std::string& remedy) {
  error(place, what + "; " + remedy);
}

void Problems::error(const Place& place, const std::string& message) {
  errors_.push_back({place, place.text() + ": error: " + message});
}

void Problems::warning(const Place& place, const std::string& what, const std::string& remedy) {
  warnings_.push_back({place, place.text() + ": warning: " + what + "; " + remedy});
}

void Problems::throw_errors(Failure failure) const {
  if (errors_.empty()) return;
  auto sorted = errors_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Problem& a, const Problem& b) {
    const auto order = [](const Place& p) { return std::tuple(p.line == 0, p.line, p.column); };
    return order(a.place) < order(b.place);
  });
  std::string all;
  for (const Problem& problem : sorted) all += (all.empty() ? "" : "\n") + problem.text;
  throw Error(failure, all);
}

std::vector<std::string> Problems::warnings() const {
  std::vector<std::string> texts;
  for (const Problem& problem : warnings_) texts.push_back(problem.text);
  return texts;
}

std::string nearest(std::string_view word, const std::vector<std::string>& candidates) {
  std::size_t best = std::max<std::size_t>(2, word.size() / 3) + 1;
  std::string found;
  for (const std::string& candidate : candidates) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance >= best || distance >= candidate.size()) continue;
    best = distance;
    found = candidate;
  }
  return found;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  if (const std::string near = nearest(word, candidates); !near.empty()) return "did you mean '" + near + "'?";
  return candidates.empty() ? "there is nothing to choose from" : "there is: " + join(candidates);
}

std::string join(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) all += (all.empty() ? "" : ", ") + word;
  return all;
}

}  // namespace carom
