#pragma once
// The arrays with one entry a particle, registered once by name: what belongs to a particle goes where it goes.
//
//   system.fields.add("acceleration", a_);                         // a field: it migrates with its particle
//   system.fields.add_working([&] { list_.reset(); },              // working memory: freed before other particles
//                             [&] { list_.emplace(…); });          // come, made again for them
//
// The particles' own arrays are fields from the start. What divides or keeps particles walks over the registry; no
// method packs or unpacks anything by hand.

#include <cstddef>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/base/vec.h"

namespace carom {

class Fields {
 public:
  /// What a field is to a run.
  enum class Kind {
    constant,  ///< given by the initial state, never changed
    state      ///< part of the state: what goes on with the same state goes on with the same bits
  };

  /// Registers a vector that has an entry for each particle of this rank and outlives the registry's use. A name that
  /// is there already now stands for this vector.
  template <class T>
  void add(std::string name, std::vector<T>& values, Kind kind = Kind::state) {
    static_assert(std::is_trivially_copyable_v<T> || std::is_same_v<T, Vec<2>> || std::is_same_v<T, Vec<3>>);
    std::erase_if(fields_, [&](const auto& field) { return field->name == name; });
    fields_.push_back(std::make_unique<Of<T>>(std::move(name), kind, values));
  }
  /// Registers working memory and calls prepare(). `owner` names it, for remove().
  void add_working(const void* owner, std::function<void()> release, std::function<void()> prepare) {
    prepare();
    working_.push_back({owner, std::move(release), std::move(prepare)});
  }
  void remove_working(const void* owner) {
    std::erase_if(working_, [&](const Working& each) { return each.owner == owner; });
  }

  // For the decomposition and for checkpoints.

  /// One registered field.
  struct Field {
    Field(std::string name_, Kind kind_, std::size_t size_) : name(std::move(name_)), kind(kind_), size(size_) {}
    virtual ~Field() = default;
    virtual std::byte* data() = 0;                 ///< of the first particle
    virtual void resize(std::size_t entries) = 0;  ///< 0: frees the memory
    const std::string name;
    const Kind kind;
    const std::size_t size;  ///< of an entry [bytes]
  };
  const std::vector<std::unique_ptr<Field>>& all() const { return fields_; }
  /// What all fields hold of one particle [bytes].
  std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& field : fields_) sum += field->size;
    return sum;
  }
  /// Copies all that belongs to particle i to, or from, bytes() bytes.
  void pack(Id i, std::byte* to) const {
    for (const auto& field : fields_) {
      std::memcpy(to, field->data() + i * field->size, field->size);
      to += field->size;
    }
  }
  void unpack(Id i, const std::byte* from) {
    for (const auto& field : fields_) {
      std::memcpy(field->data() + i * field->size, from, field->size);
      from += field->size;
    }
  }
  /// Makes room for so many particles in all fields; 0: frees the memory.
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
  struct Of final : Field {
    Of(std::string name_, Kind kind_, std::vector<T>& values_)
        : Field(std::move(name_), kind_, sizeof(T)), values(values_) {}
    std::byte* data() override { return reinterpret_cast<std::byte*>(values.data()); }
    void resize(std::size_t entries) override {
      if (entries == 0)
        std::vector<T>().swap(values);
      else
        values.resize(entries);
    }
    std::vector<T>& values;
  };
  struct Working {
    const void* owner;
    std::function<void()> release, prepare;
  };

  std::vector<std::unique_ptr<Field>> fields_;
  std::vector<Working> working_;
};

}  // namespace carom
