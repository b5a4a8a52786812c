// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// A file descriptor that closes itself.

#include <unistd.h>

#include <cstddef>
#include <utility>

namespace carom {

/// Most bytes in one write: on ext4 of Linux 6.18 one large write to a new file takes several times as long as the same
/// bytes in pieces.
constexpr std::size_t kLargestWrite = 1 << 20;

class Descriptor {
 public:
  /// `number`: the result of ::open(); negative: no file.
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }
  bool is_open() const { return number_ >= 0; }

 private:
  int number_;
};

}  // namespace carom
