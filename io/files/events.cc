// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/events.h"

#include "io/files/hdf5.h"
#include "io/files/version.h"

namespace carom {

namespace {

/// One column: the rows that wait in memory, and the data set in the file.
template <class T>
struct EventColumn {
  std::vector<T> waiting;
  hdf5::Series<T> written;
  EventColumn(hdf5::File& file, const hdf5::Handle& group, const char* name, std::vector<hsize_t> row_shape = {})
      : written(file, group, name, std::move(row_shape)) {}
  void write() {
    written.append(waiting);
    waiting.clear();
  }
};

}  // namespace

template <int D>
struct EventWriter<D>::Contents {
  static constexpr std::size_t kRowsPerWrite = 16384;  // rows
  explicit Contents(hdf5::File at) : file(std::move(at)) {}

  void create(const Deck& deck) {
    const hdf5::Handle parameters = file.group("parameters");
    file.write_attribute(group, "version", std::vector<std::int32_t>{1, 0});
    file.write_attribute(group, "creator", "carom " + version_string());
    file.write_attribute(group, "dimension", std::int32_t{D});
    file.write_text(parameters, "deck", deck.toml_text);
    file.write_text(parameters, "title", deck.title);
    file.write_text(parameters, "integrator", deck.integrator);
    file.flush();
  }

  /// Calls the action for every column.
  template <class Action>
  void each(Action action) {
    for (auto* column : {&time, &time_in_slab, &x_lo, &x_hi, &impulse}) action(*column);
    for (auto* column : {&generation, &lo, &hi}) action(*column);
    action(slab);
    action(kind);
    action(image);
  }

  void add(double slab_start, const Contact<D>& c) {
    time.waiting.push_back(slab_start + c.key.time);
    slab.waiting.push_back(slabs_done);
    time_in_slab.waiting.push_back(c.key.time);
    generation.waiting.push_back(c.key.generation);
    constexpr std::uint8_t kFirstStep = 3;  // after the kinds of EventKind
    const bool step = c.exchange.event != PairEvent::core;
    kind.waiting.push_back(step ? kFirstStep - 1 + static_cast<std::uint8_t>(c.exchange.event)
                                : static_cast<std::uint8_t>(c.key.kind));
    lo.waiting.push_back(c.key.lo);
    hi.waiting.push_back(c.key.hi);
    for (int k = 0; k < D; ++k) {
      image.waiting.push_back(c.key.image[k]);
      x_lo.waiting.push_back(c.x_lo[k]);
      x_hi.waiting.push_back(c.x_hi[k]);
      impulse.waiting.push_back(c.impulse[k]);
    }
  }

  void write() {
    if (time.waiting.empty()) return;
    each([](auto& column) { column.write(); });
    file.flush();
  }

  hdf5::File file;
  hdf5::Handle group = file.group("events");
  EventColumn<double> time{file, group, "time"};
  EventColumn<std::int64_t> slab{file, group, "slab"};
  EventColumn<double> time_in_slab{file, group, "time_in_slab"};
  EventColumn<std::uint32_t> generation{file, group, "generation"};
  EventColumn<std::uint8_t> kind{file, group, "kind"};
  EventColumn<std::uint32_t> lo{file, group, "lo"}, hi{file, group, "hi"};
  EventColumn<std::int32_t> image{file, group, "image", {D}};
  EventColumn<double> x_lo{file, group, "x_lo", {D}}, x_hi{file, group, "x_hi", {D}},
      impulse{file, group, "impulse", {D}};
  std::int64_t slabs_done = 0;
};

template <int D>
EventWriter<D>::EventWriter(const std::filesystem::path& path, const Deck& deck, const std::optional<EventMark>& mark)
    : contents_(std::make_unique<Contents>(mark ? hdf5::File::append(path) : hdf5::File::create(path))) {
  if (!mark) {
    contents_->create(deck);
    return;
  }
  contents_->each([&](auto& column) { column.written.cut(mark->rows.length); });
  contents_->slabs_done = mark->slabs;
}

template <int D>
EventWriter<D>::~EventWriter() = default;

template <int D>
void EventWriter<D>::contacts(double slab_start, std::span<const Contact<D>> contacts) {
  for (const Contact<D>& c : contacts) contents_->add(slab_start, c);
  if (contents_->time.waiting.size() >= Contents::kRowsPerWrite) contents_->write();
}

template <int D>
void EventWriter<D>::frame(const Snapshot<D>&) {
  contents_->write();
}

template <int D>
void EventWriter<D>::thermo(const Snapshot<D>&) {
  contents_->write();
}

template <int D>
void EventWriter<D>::progress(const Statistics& statistics) {
  contents_->slabs_done = statistics.steps;
}

template <int D>
EventMark EventWriter<D>::mark() {
  contents_->write();
  return {hdf5::mark(contents_->file, kEventRows, contents_->time.written.rows()), contents_->slabs_done};
}

template <int D>
void EventWriter<D>::close() {
  contents_->write();
  contents_->file.close();
}

template class EventWriter<2>;
template class EventWriter<3>;

}  // namespace carom
