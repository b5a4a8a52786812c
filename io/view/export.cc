// SPDX-License-Identifier: BSD-3-Clause
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>

#include "engine/base/error.h"
#include "io/files/text_file.h"
#include "io/view/run_source.h"
#include "io/view/view.h"

namespace carom {

namespace {

using Json = nlohmann::json;

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::string_view three = bytes.substr(at, 3);
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (k < three.size() ? static_cast<unsigned char>(three[k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) text += k <= three.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// All rows of thermo.csv, or at most about `most` of them at equal distances, with the last one.
std::string thinned_thermo(RunSource& run, std::size_t most) {
  std::string all;
  for (std::string part; !(part = run.answer("thermo/" + std::to_string(all.size()))->body).empty();) all += part;
  const auto rows = static_cast<std::size_t>(std::count(all.begin(), all.end(), '\n'));
  const std::size_t every = rows / most + 1;
  std::istringstream in(all);
  std::string line, kept;
  for (std::size_t row = 0; std::getline(in, line); ++row)
    if (row < 2 || (row - 1) % every == 0 || row + 1 == rows) kept += line + '\n';
  return kept;
}

}  // namespace

void export_page(const ViewOptions& options) {
  Json stored, states = Json::array();
  std::string notes;
  const double share = 1e6 * static_cast<double>(options.most_megabytes) / static_cast<double>(options.runs.size());
  for (std::size_t k = 0; k < options.runs.size(); ++k) {
    RunSource run(options.runs[k], false);
    const std::string prefix = std::to_string(k) + "/";
    Json state = run.state();
    const auto frames = state.at("frames").get<std::uint64_t>();
    if (frames == 0) throw Error(Failure::file, options.runs[k].string() + ": no frame has been written yet");
    const std::string thermo = thinned_thermo(run, 4000), particles = base64(run.answer("particles")->body),
                      bonds = base64(run.answer("bonds")->body);
    const auto frame_of = [&](std::uint64_t number) {
      return run.answer("frame/" + std::to_string(number)).value().body;
    };
    const double fixed = static_cast<double>(thermo.size() + particles.size() + bonds.size()) + 2e5;
    const double frame_bytes = 4.0 / 3.0 * static_cast<double>(frame_of(0).size()) + 32;
    if (share < fixed + frame_bytes)
      throw Error(Failure::deck,
                  fmt::format("{}: not one frame of {} particles fits into a page of {} MB; --max-size {} "
                              "takes one, 64 MB or less suit browsers best",
                              options.runs[k].string(), run.particles(), options.most_megabytes,
                              std::ceil((fixed + frame_bytes) * static_cast<double>(options.runs.size()) / 1e6)));
    const auto kept = std::min(frames, static_cast<std::uint64_t>((share - fixed) / frame_bytes));
    for (std::uint64_t n = 0; n < kept; ++n)
      stored[prefix + "frame/" + std::to_string(n)] =
          base64(frame_of(kept == 1 ? frames - 1 : n * (frames - 1) / (kept - 1)));
    stored[prefix + "thermo/0"] = thermo;
    stored[prefix + "particles"] = particles;
    stored[prefix + "bonds"] = bonds;
    for (const std::string_view name : RunSource::kAverages)
      if (const auto table = run.answer(name)) stored[prefix + std::string(name)] = table->body;
    state["frames"] = kept;
    state["thermo"] = thermo.size();
    if (state["status"] == "running") state["status"] = "running when exported";
    states.push_back(state);
    notes += fmt::format("{}: {} of {} frames{}\n", options.runs[k].string(), kept, frames,
                         kept < frames ? ", what --max-size takes" : "");
  }
  stored["runs"] = states.dump();
  std::string text = stored.dump(-1, ' ', true, Json::error_handler_t::replace);
  for (std::size_t at = 0; (at = text.find("</", at)) != std::string::npos; at += 3) text.replace(at, 2, "<\\/");
  std::string page = kPage;
  const std::string place = "json\">null";
  page.replace(page.find(place) + place.size() - 4, 4, text);
  std::FILE* const account = is_standard_output(*options.export_to) ? stderr : stdout;
  write_file_atomically(*options.export_to, page);
  std::fputs(notes.c_str(), account);
}

}  // namespace carom
