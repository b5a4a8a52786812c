#include "io/averages.h"

#include <spdlog/fmt/fmt.h>

#include <bit>
#include <utility>

#include "io/text_file.h"

namespace carom {

namespace {

/// A name in the head of a table: in quotes where it could be taken for several.
std::string quoted(const std::string& name) {
  if (name.find_first_of(",\"\n") == std::string::npos) return name;
  std::string text = "\"";
  for (const char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

}  // namespace

template <int D>
RdfWriter<D>::RdfWriter(std::filesystem::path path, const System<D>& system, const RadialDistributionOptions& options)
    : RadialDistribution<D>(system, options), path_(std::move(path)), species_(system.species) {}

template <int D>
void RdfWriter<D>::sample(double time, const Particles<D>& particles) {
  RadialDistribution<D>::sample(time, particles);
  if (std::has_single_bit(this->samples())) close();
}

template <int D>
void RdfWriter<D>::close() const {
  if (this->samples() == 0) return;
  std::string text = "r,g";
  std::vector<std::vector<double>> columns = {this->radii(), this->g()};
  if (species_.size() > 1)
    for (std::size_t a = 0; a < species_.size(); ++a)
      for (std::size_t b = a; b < species_.size(); ++b) {
        text += "," + quoted("g_" + species_[a] + "_" + species_[b]);
        columns.push_back(this->g(a, b));
      }
  for (std::size_t row = 0; row < columns[0].size(); ++row)
    for (std::size_t c = 0; c < columns.size(); ++c) text += fmt::format("{}{}", c == 0 ? "\n" : ",", columns[c][row]);
  write_file_atomically(path_, text + "\n");
}

template <int D>
std::vector<ContactValue> RdfWriter<D>::contact_values() const {
  std::vector<ContactValue> values;
  for (std::size_t a = 0; a < species_.size(); ++a)
    for (std::size_t b = a; b < species_.size(); ++b)
      if (const auto g = this->contact_value(a, b)) values.push_back({species_[a], species_[b], *g});
  return values;
}

template <int D>
MsdWriter<D>::MsdWriter(std::filesystem::path path, const System<D>& system, const Sampling& sampling)
    : MeanSquaredDisplacement<D>(system, sampling), path_(std::move(path)), species_(system.species) {}

template <int D>
void MsdWriter<D>::sample(double time, const Particles<D>& particles) {
  MeanSquaredDisplacement<D>::sample(time, particles);
  if (std::has_single_bit(this->samples())) close();
}

template <int D>
void MsdWriter<D>::close() const {
  if (this->samples() == 0) return;
  std::string text = "time,origins,msd";
  if (species_.size() > 1)
    for (const std::string& name : species_) text += "," + quoted("msd_" + name);
  for (const auto& row : this->rows()) {
    text += fmt::format("\n{},{},{}", row.time, row.origins, row.msd);
    if (species_.size() > 1)
      for (const double msd : row.of) text += fmt::format(",{}", msd);
  }
  write_file_atomically(path_, text + "\n");
}

template class RdfWriter<2>;
template class RdfWriter<3>;
template class MsdWriter<2>;
template class MsdWriter<3>;

}  // namespace carom
