// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Values as bytes for messages and checkpoints, which only the same program on the same kind of machine reads.

#include <cstddef>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

namespace carom {

using Bytes = std::vector<std::byte>;

/// Appends `size` bytes.
inline void put_bytes(Bytes& to, const void* from, std::size_t size) {
  const std::size_t at = to.size();
  to.resize(at + size);
  std::memcpy(to.data() + at, from, size);
}

/// Appends a value, byte by byte.
template <class T>
void put(Bytes& to, const T& value) {
  put_bytes(to, &value, sizeof(T));
}

/// Reads what put() wrote, in its order.
class Reader {
 public:
  explicit Reader(const Bytes& bytes) : at_(bytes.data()), end_(bytes.data() + bytes.size()) {}
  bool more() const { return at_ < end_; }
  template <class T>
  T get() {
    T value;
    std::memcpy(static_cast<void*>(&value), at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  /// Skips this many bytes; returns where they begin.
  const std::byte* skip(std::size_t bytes) { return std::exchange(at_, at_ + bytes); }

 private:
  const std::byte *at_, *end_;
};

}  // namespace carom
