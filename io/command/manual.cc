// SPDX-License-Identifier: BSD-3-Clause
#include "io/command/manual.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "io/deck/schema.h"
#include "io/files/version.h"

namespace carom {
namespace {

using Option = const CLI::Option*;

std::vector<Option> options_of(const CLI::App& command) {
  return command.get_options([](Option option) { return !option->get_positional() && !option->get_group().empty(); });
}

std::vector<Option> arguments_of(const CLI::App& command) {
  return command.get_options([](Option option) { return option->get_positional(); });
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

/// "-o", "--output": all names of an option.
std::vector<std::string> names_of(Option option) {
  std::vector<std::string> names;
  for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

bool takes_value(Option option) { return option->get_items_expected_max() > 0; }

/// Keys as `--set` names them: integrator.step; those of lists have the number of the table, particles.0.radius.
std::vector<std::string> set_keys() {
  std::vector<std::string> keys;
  for (const TableSchema& table : deck_schema()) {
    const std::string head = table.name.empty() ? "" : table.name + (table.list ? ".0." : ".");
    for (const Key& key : table.keys) keys.push_back(head + key.name);
    for (const Variant& variant : table.variants)
      for (const Key& key : variant.keys) keys.push_back(head + key.name);
  }
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

std::string joined(const std::vector<std::string>& words, std::string_view between) {
  std::string all;
  for (const std::string& word : words) all.append(all.empty() ? "" : between).append(word);
  return all;
}

std::string replaced(std::string text, char what, std::string_view with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size())
    text.replace(at, 1, with);
  return text;
}

// ---- Manual ----

std::string roff(const std::string& text) {
  std::string out = replaced(replaced(text, '\\', "\\e"), '-', "\\-");
  return out.starts_with('.') || out.starts_with('\'') ? "\\&" + out : out;
}

void describe(std::ostream& out, Option option) {
  out << ".TP\n\\fB" << roff(joined(names_of(option), ", ")) << "\\fR";
  if (takes_value(option) && !option->get_type_name().empty())
    out << " \\fI" << roff(option->get_type_name()) << "\\fR";
  out << '\n' << roff(option->get_description()) << '\n';
}

/// Lines as they are, without filling.
void verbatim(std::ostream& out, const std::string& page) {
  out << ".nf\n";
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) out << roff(line) << '\n';
  out << ".fi\n";
}

// ---- Completion ----

bool is_file(Option option) {
  const std::string type = option->get_type_name();
  return type.find("FILE") != type.npos || type.find("DIR") != type.npos || type.find("DECK") != type.npos ||
         type.find("RUN") != type.npos;
}

std::string bash_script(const CLI::App& app) {
  std::ostringstream out;
  out << "# Completion of carom in bash.\n"
         "_carom() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]}\n"
         "  COMPREPLY=()\n"
         "  if [ \"$COMP_CWORD\" = 1 ]; then\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"";
  for (const CLI::App* command : commands_of(app)) out << command->get_name() << ' ';
  out << "--help --version\" -- \"$word\")\n    return\n  fi\n"
         "  if [ \"$before\" = --set ]; then\n"
         "    compopt -o nospace\n"
         "    mapfile -t COMPREPLY < <(compgen -S = -W \""
      << joined(set_keys(), " ")
      << "\" -- \"$word\")\n    return\n  fi\n"
         "  case $command in\n";
  for (const CLI::App* command : commands_of(app)) {
    std::vector<std::string> words;
    for (Option option : options_of(*command)) std::ranges::copy(names_of(option), std::back_inserter(words));
    out << "    " << command->get_name() << ") [[ $word == -* ]] && mapfile -t COMPREPLY < <(compgen -W \""
        << joined(words, " ") << "\" -- \"$word\") ;;\n";
  }
  out << "  esac\n"
         "}\n"
         "complete -o default -F _carom carom\n";
  return out.str();
}

std::string zsh_script(const CLI::App& app) {
  const auto quoted = [](const std::string& text) {  // within '…' and […]
    std::string out;
    for (const char c : text) {
      if (c == '\'') out += "'\\'";
      if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
      out += c;
    }
    return out;
  };
  std::ostringstream out;
  out << "#compdef carom\n"
         "# Completion of carom in zsh.\n"
         "_carom() {\n"
         "  local -a keys=("
      << joined(set_keys(), " ")
      << ")\n"
         "  if (( CURRENT == 2 )); then\n"
         "    local -a commands=(\n";
  for (const CLI::App* command : commands_of(app))
    out << "      '" << quoted(command->get_name()) << ':' << quoted(command->get_description()) << "'\n";
  out << "    )\n    _describe command commands\n    return\n  fi\n"
         "  local command=$words[2]\n"
         "  shift words\n  (( CURRENT-- ))\n"
         "  case $command in\n";
  for (const CLI::App* command : commands_of(app)) {
    out << "    " << command->get_name() << ") _arguments -s";
    for (Option option : options_of(*command))
      for (const std::string& name : names_of(option)) {
        out << " \\\n      '" << (name == "--set" ? "*" : "") << name << '[' << quoted(option->get_description())
            << ']';
        if (name == "--set")
          out << ":key:compadd -S = -a keys";
        else if (takes_value(option))
          out << ':' << quoted(option->get_name(true, true).empty() ? "value" : name.substr(name.rfind('-') + 1)) << ':'
              << (is_file(option) ? "_files" : " ");
        out << '\'';
      }
    for (Option argument : arguments_of(*command))
      out << " \\\n      '*:" << quoted(argument->get_name()) << ":_files'";
    out << " ;;\n";
  }
  out << "  esac\n"
         "}\n"
         "_carom \"$@\"\n";
  return out.str();
}

std::string fish_script(const CLI::App& app) {
  const auto quoted = [](const std::string& text) { return replaced(replaced(text, '\\', "\\\\"), '\'', "\\'"); };
  std::ostringstream out;
  out << "# Completion of carom in fish.\n";
  for (const CLI::App* command : commands_of(app))
    out << "complete -c carom -n __fish_use_subcommand -f -a " << command->get_name() << " -d '"
        << quoted(command->get_description()) << "'\n";
  for (const CLI::App* command : commands_of(app))
    for (Option option : options_of(*command)) {
      out << "complete -c carom -n '__fish_seen_subcommand_from " << command->get_name() << '\'';
      for (const std::string& name : option->get_snames()) out << " -s " << name;
      for (const std::string& name : option->get_lnames()) out << " -l " << name;
      const bool set = option->check_lname("set");
      if (takes_value(option)) out << (is_file(option) ? " -r" : " -x");
      if (set) out << " -a '" << joined(set_keys(), "= ") << "='";
      out << " -d '" << quoted(option->get_description()) << "'\n";
    }
  return out.str();
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  std::ostringstream out;
  out << ".TH CAROM 1 \"\" \"Carom " << roff(version_string()) << "\" \"User Commands\"\n"
      << ".SH NAME\ncarom \\- event\\-driven molecular dynamics with smooth forces\n.SH SYNOPSIS\n";
  for (const CLI::App* command : commands_of(app)) {
    out << ".B carom " << roff(command->get_name()) << "\n";
    for (Option argument : arguments_of(*command))
      out << ".I " << roff(argument->get_type_name().empty() ? argument->get_name() : argument->get_type_name())
          << '\n';
    out << ".RI [ OPTION ]...\n.br\n";
  }
  out << ".SH DESCRIPTION\n"
         "Hard spheres and discs that also feel springs, gravity, charges and fields, with integrators that keep the "
         "energy through collisions. A run is described by a deck, a file in TOML.\n"
         ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) {
    out << ".SS carom " << roff(command->get_name()) << '\n' << roff(command->get_description()) << ".\n";
    for (Option option : options_of(*command)) describe(out, option);
  }
  out << ".SH EXIT STATUS\n"
         ".TP\n0\ndone\n.TP\n2\na mistake in the deck or on the command line\n.TP\n3\nan impossible initial state\n"
         ".TP\n4\na numerical failure\n.TP\n5\ntrouble with files\n"
         ".TP\n70\na fault of the program, no memory, or a rank lost\n"
         ".TP\n75\ninterrupted by a signal or \\-\\-max\\-wall, to be continued\n"
         ".SH SIGNALS\n"
         "TERM, INT, HUP and USR2 write a checkpoint and stop the run, USR1 writes one and lets it go on.\n"
         ".SH THE DECK\n";
  verbatim(out, schema_page(false));
  out << ".SH METHODS\n";
  verbatim(out, methods_page());
  return out.str();
}

std::string completion_script(const CLI::App& app, std::string_view shell) {
  if (shell == "bash") return bash_script(app);
  return shell == "zsh" ? zsh_script(app) : fish_script(app);
}

}  // namespace carom
