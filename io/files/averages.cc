// SPDX-License-Identifier: BSD-3-Clause
#include "io/files/averages.h"

#include <spdlog/fmt/fmt.h>

#include <bit>
#include <utility>

#include "io/files/text_file.h"

namespace carom {

namespace {

/// A name in the head of a table: in quotes if it could be read as several names.
std::string quoted(const std::string& name) {
  if (name.find_first_of(",\"\n") == std::string::npos) return name;
  std::string text = "\"";
  for (const char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

}  // namespace

template <int D>
AverageWriter<D>::AverageWriter(std::filesystem::path path, std::unique_ptr<Observable<D>> average)
    : path_(std::move(path)), average_(std::move(average)) {}

template <int D>
void AverageWriter<D>::sample(double time, const Particles<D>& particles) {
  average_->sample(time, particles);
  if (std::has_single_bit(average_->samples())) close();
}

template <int D>
void AverageWriter<D>::close() const {
  if (average_->samples() == 0) return;
  const std::vector<TableColumn> table = average_->table();
  std::string text;
  for (const TableColumn& column : table) text += (text.empty() ? "" : ",") + quoted(column.name);
  for (std::size_t row = 0; row < table[0].values.size(); ++row)
    for (const TableColumn& column : table)
      text += fmt::format("{}{}", &column == table.data() ? "\n" : ",", column.values[row]);
  write_file_atomically(path_, text + "\n");
}

template class AverageWriter<2>;
template class AverageWriter<3>;

}  // namespace carom
