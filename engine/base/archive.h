// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// Writes state to bytes and reads it back; one function `archive` lists the members for both directions.
//
//   struct Sums {
//     std::uint64_t samples;
//     std::vector<double> of_bin;
//     void archive(Archive& archive) { archive(samples, of_bin); }
//   };
//   Archive out;             Archive in(out.bytes());
//   sums.archive(out);       others.archive(in);         // now `others` equals `sums`
//
// Plain values are copied byte by byte; vectors and arrays element by element, also of types with a member `archive`.
// Only the same program on the same kind of machine can read the bytes.

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/base/bytes.h"
#include "engine/base/error.h"

namespace carom {

class Archive {
 public:
  /// An archive that is written to.
  Archive() = default;
  /// An archive that is read from.
  explicit Archive(Bytes bytes) : bytes_(std::move(bytes)), reading_(true) {}

  template <class... Values>
  void operator()(Values&... values) {
    (one(values), ...);
  }
  const Bytes& bytes() const { return bytes_; }
  bool more() const { return at_ < bytes_.size(); }
  /// Throws Error(Failure::file) if bytes are left after the last value has been read.
  void finish() const {
    if (at_ != bytes_.size()) mismatch();
  }

 private:
  template <class T>
  static constexpr bool plain = std::is_trivially_destructible_v<T> && !requires(T value, Archive& archive) {
    value.archive(archive);
  };
  template <class T>
  void one(T& value) {
    if constexpr (plain<T>)
      raw(&value, sizeof value);
    else
      value.archive(*this);
  }
  void one(std::string& text) {
    std::vector<char> values(text.begin(), text.end());
    one(values);
    text.assign(values.begin(), values.end());
  }
  template <class T>
  void one(std::vector<T>& values) {
    std::uint64_t size = values.size();
    one(size);
    if (reading_ && size > (bytes_.size() - at_) / (plain<T> ? sizeof(T) : 1)) mismatch();
    values.resize(static_cast<std::size_t>(size));
    if constexpr (plain<T>)
      raw(values.data(), values.size() * sizeof(T));
    else
      for (T& value : values) one(value);
  }
  template <class T, std::size_t N>
  void one(std::array<T, N>& values) {
    for (T& value : values) one(value);
  }
  void raw(void* value, std::size_t size) {
    if (!reading_) {
      bytes_.resize(bytes_.size() + size);
      if (size > 0) std::memcpy(bytes_.data() + bytes_.size() - size, value, size);
      return;
    }
    if (size > bytes_.size() - at_) mismatch();
    if (size > 0) std::memcpy(value, bytes_.data() + at_, size);
    at_ += size;
  }
  [[noreturn]] static void mismatch() {
    throw Error(Failure::file, "the state to be restored is that of something else");
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  bool reading_ = false;
};

}  // namespace carom
