// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <numeric>

#include "engine/base/error.h"
#include "io/files/hdf5.h"

namespace carom::hdf5 {

namespace {

/// Chunks of about 8 kB for small rows, and of at most 43,000 entries (about 1 MiB of positions) for large rows.
std::vector<hsize_t> chunk_of(const std::vector<hsize_t>& shape, std::uint64_t row_bytes) {
  constexpr hsize_t kMostChunkEntries = 43000, kSmallChunk = 8192;
  std::vector<hsize_t> chunk = shape;
  chunk[0] = std::max<hsize_t>(1, kSmallChunk / std::max<hsize_t>(1, row_bytes));
  for (std::size_t k = 1; k < chunk.size(); ++k) chunk[k] = std::clamp<hsize_t>(chunk[k], 1, kMostChunkEntries);
  return chunk;
}

}  // namespace

SeriesBase::SeriesBase(const File& file, const Handle& where, const std::string& name, hid_t type,
                       std::vector<hsize_t> row_shape)
    : label_("write to data set " + name), file_(&file), shape_(std::move(row_shape)) {
  row_elements_ = std::accumulate(shape_.begin(), shape_.end(), hsize_t{1}, std::multiplies<>());
  shape_.insert(shape_.begin(), 0);
  const int rank = static_cast<int>(shape_.size());
  if (H5Lexists(where.id(), name.c_str(), H5P_DEFAULT) > 0) {
    dataset_ = Handle(file.check(H5Dopen2(where.id(), name.c_str(), H5P_DEFAULT), "open data set " + name), H5Dclose);
    const Handle space(H5Dget_space(dataset_.id()), H5Sclose);
    std::vector<hsize_t> there(shape_.size());
    const bool alike = H5Sget_simple_extent_ndims(space.id()) == rank &&
                       H5Sget_simple_extent_dims(space.id(), there.data(), nullptr) == rank &&
                       std::equal(shape_.begin() + 1, shape_.end(), there.begin() + 1);
    if (!alike) throw Error(Failure::file, file.path().string() + ": data set " + name + " belongs to another run");
    rows_ = there[0];
    return;
  }
  dataset_ = file.create_data_set(where, name, type, shape_, chunk_of(shape_, row_elements_ * H5Tget_size(type)));
}

void SeriesBase::append(hid_t type, const void* data, std::size_t elements) {
  if (elements == 0) return;
  std::vector<hsize_t> start(shape_.size(), 0), count = shape_;
  start[0] = rows_;
  count[0] = elements / row_elements_;
  extend(count[0]);
  file_->write_part(dataset_, type, data, start, count, label_);
}

void SeriesBase::append_row() { extend(1); }

void SeriesBase::drop_row() { cut(rows_ - 1); }

void SeriesBase::cut(std::uint64_t rows) {
  if (rows > rows_)
    throw Error(Failure::file, file_->path().string() + ": has " + std::to_string(rows_) + " rows of " +
                                   std::to_string(rows) + ": it was cut or exchanged since that number was taken");
  if (rows == rows_) return;
  rows_ = rows;
  extend(0);
}

void SeriesBase::write_part(hid_t type, const void* data, std::size_t first, std::size_t elements) {
  if (elements == 0) return;
  std::vector<hsize_t> start(shape_.size(), 0), count = shape_;
  start[0] = rows_ - 1;
  count[0] = 1;
  start[1] = first;
  count[1] = elements / (row_elements_ / shape_[1]);
  file_->write_part(dataset_, type, data, start, count, label_);
}

void SeriesBase::extend(std::uint64_t rows) {
  std::vector<hsize_t> size = shape_;
  size[0] = rows_ + rows;
  file_->check(H5Dset_extent(dataset_.id(), size.data()), label_);
  rows_ = size[0];
}

}  // namespace carom::hdf5
