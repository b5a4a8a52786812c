// SPDX-License-Identifier: BSD-3-Clause
#pragma once
// The manual page of the command and its completion in shells, made from its options and from the schema of decks.

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

namespace carom {

/// carom(1) in roff, for man(1) (man(7), groff_man(7)).
std::string manual_page(const CLI::App& app);

/// A script that completes sub-commands, options, their choices, file names and keys of decks; `shell`: bash, zsh or
/// fish.
std::string completion_script(const CLI::App& app, std::string_view shell);

}  // namespace carom
