// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "engine/run/simulation.h"

namespace carom::test {

/// Collects contacts, with times since the start of the run.
class ContactCollector : public Observer<2> {
 public:
  void contacts(double start, std::span<const Contact<2>> more) override {
    for (Contact<2> contact : more) {
      contact.key.time += start;
      all.push_back(contact);
    }
  }
  std::vector<Contact<2>> all;
};

}  // namespace carom::test
