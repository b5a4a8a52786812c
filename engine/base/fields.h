// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The registry of a run's state by name: arrays with one entry a particle, and single values of the whole run.
//
//   system.fields.add("acceleration", a_);                         // a field: it migrates with its particle
//   system.fields.add_working([&] { list_.reset(); },              // working memory: released before other particles
//                             [&] { list_.emplace(…); });          // arrive, built again for them
//   system.fields.add_value("debt", debt_);                        // one value of the run
//
// The particles' own arrays are always registered. Decomposition and checkpoints loop over the registry; no method
// packs or unpacks anything itself.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/base/archive.h"
#include "engine/base/vec.h"

namespace carom {

class Fields {
 public:
  /// Whether an entry can change during a run.
  enum class Kind {
    constant,  ///< one entry a particle, set by the initial state, never changed
    state      ///< one entry a particle, part of the state that determines all later bits
  };
  /// The scalars of an entry, as other programs can read them.
  enum class Scalar { float64, int32, uint32, uint16, bytes };

  /// A particle that stays on this rank, or arrives.
  struct Arrival {
    Id id;
    Id place;             ///< of one that stays, before take()
    const std::byte* at;  ///< the bytes of one that arrives, as pack() writes them; null: it stays
  };

  /// An array with one entry a particle.
  struct Field {
    Field(std::string name_, Kind kind_, Scalar scalar_, std::size_t size_, std::size_t columns_)
        : name(std::move(name_)), kind(kind_), scalar(scalar_), size(size_), columns(columns_) {}
    virtual ~Field() = default;
    virtual std::byte* data() = 0;  ///< the first entry
    virtual std::size_t entries() const = 0;
    virtual void resize(std::size_t entries) = 0;  ///< 0: frees the memory
    /// Replaces all entries; `offset`: of this field in the bytes of a particle.
    virtual void take(std::span<const Arrival> arrivals, std::size_t offset) = 0;
    const std::string name;
    const Kind kind;
    const Scalar scalar;
    const std::size_t size;     ///< bytes of an entry
    const std::size_t columns;  ///< scalars in an entry
  };

  /// Registers a vector with an entry for each particle of this rank; it must outlive the use of the registry. It
  /// replaces a vector registered by the same name.
  template <class T>
  void add(std::string name, std::vector<T>& values, Kind kind = Kind::state) {
    std::erase_if(fields_, [&](const auto& field) { return field->name == name; });
    fields_.push_back(std::make_unique<List<T>>(std::move(name), kind, values));
  }
  /// A value of the whole run. If ranks have different values, rank 0's counts.
  struct OfRun {
    std::string name;
    std::function<void(Archive&)> archive;  ///< writes or reads it
  };
  void add_of_run(OfRun entry) {
    std::erase_if(of_run_, [&](const OfRun& each) { return each.name == entry.name; });
    of_run_.push_back(std::move(entry));
  }
  /// Registers a value of the whole run: plain, a vector, or a type with a member archive(Archive&).
  template <class T>
  void add_value(std::string name, T& value) {
    add_of_run({std::move(name), [&value](Archive& archive) { archive(value); }});
  }

  /// Registers working memory and calls prepare(). `owner` identifies it for remove_working().
  void add_working(const void* owner, std::function<void()> release, std::function<void()> prepare) {
    prepare();
    working_.push_back({owner, std::move(release), std::move(prepare)});
  }
  void remove_working(const void* owner) {
    std::erase_if(working_, [&](const Working& each) { return each.owner == owner; });
  }

  /// Called before the state is saved, on all ranks: completes values of the run that wait for sums over ranks.
  std::function<void()> settle = [] {};

  // For the decomposition and for checkpoints.

  /// The fields with an entry for each particle, and the values of the run.
  const std::vector<std::unique_ptr<Field>>& of_particles() const { return fields_; }
  const std::vector<OfRun>& of_run() const { return of_run_; }

  /// The bytes of one particle in all fields.
  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& field : fields_) sum += field->size;
    return sum;
  }
  /// Copies all fields of particle i to bytes() bytes.
  void pack(Id i, std::byte* to) const {
    for (const auto& field : fields_) {
      std::memcpy(to, field->data() + i * field->size, field->size);
      to += field->size;
    }
  }
  /// Replaces all particles.
  void take(std::span<const Arrival> arrivals) {
    std::size_t offset = 0;
    for (const auto& field : fields_) {
      field->take(arrivals, offset);
      offset += field->size;
    }
  }
  /// Resizes all fields to this many particles; 0 frees the memory.
  void resize(std::size_t particles) {
    for (const auto& field : fields_) field->resize(particles);
  }
  void release_working() {
    for (const Working& each : working_) each.release();
  }
  void prepare_working() {
    for (const Working& each : working_) each.prepare();
  }

 private:
  template <class T>
  static constexpr Scalar scalar_of() {
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, Vec<1>> || std::is_same_v<T, Vec<2>> ||
                  std::is_same_v<T, Vec<3>>)
      return Scalar::float64;
    else if constexpr (std::is_same_v<T, Image<2>> || std::is_same_v<T, Image<3>>)
      return Scalar::int32;
    else if constexpr (std::is_same_v<T, std::uint32_t>)
      return Scalar::uint32;
    else
      return std::is_same_v<T, std::uint16_t> ? Scalar::uint16 : Scalar::bytes;
  }
  static constexpr std::size_t width(Scalar scalar) {
    constexpr std::array<std::size_t, 5> kWidth{8, 4, 4, 2, 1};
    return kWidth[static_cast<std::size_t>(scalar)];
  }
  template <class T>
  struct List final : Field {
    static_assert(std::is_trivially_copyable_v<T> || scalar_of<T>() != Scalar::bytes);
    List(std::string name_, Kind kind_, std::vector<T>& values_)
        : Field(std::move(name_), kind_, scalar_of<T>(), sizeof(T), sizeof(T) / width(scalar_of<T>())),
          values(values_) {}
    std::byte* data() override { return reinterpret_cast<std::byte*>(values.data()); }
    std::size_t entries() const override { return values.size(); }
    void resize(std::size_t entries) override {
      if (entries == 0)
        std::vector<T>().swap(values);
      else
        values.resize(entries);
    }
    void take(std::span<const Arrival> arrivals, std::size_t offset) override {
      std::vector<T> all(arrivals.size());
      for (std::size_t k = 0; k < all.size(); ++k)
        if (const Arrival& each = arrivals[k]; each.at)
          std::memcpy(static_cast<void*>(&all[k]), each.at + offset, sizeof(T));
        else
          all[k] = values[each.place];
      values.swap(all);
    }
    std::vector<T>& values;
  };
  struct Working {
    const void* owner;
    std::function<void()> release, prepare;
  };

  std::vector<std::unique_ptr<Field>> fields_;
  std::vector<OfRun> of_run_;
  std::vector<Working> working_;
};

}  // namespace carom
