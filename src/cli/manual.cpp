#include "sentree/cli/manual.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <vector>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/text/file.h"

namespace sentree::cli {

namespace {

// Text as man(7) shows it: nothing in it is an instruction.
std::string plain(std::string_view text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    at_start = c == '\n';
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == '\'')
      out += "\\(aq";
    else if (c == '`')
      out += "\\(ga";
    else if (c == '^')
      out += "\\(ha";
    else if (c == '~')
      out += "\\(ti";
    else
      out += c;
  }
  return out;
}

std::string first_lower(std::string text) {
  if (text.size() > 1 && std::islower(static_cast<unsigned char>(text[1])) != 0)
    text[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(text[0])));
  return text;
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  std::vector<const CLI::App*> all;
  for (const CLI::App* sub : app.get_subcommands(nullptr)) {
    if (!sub->get_name().empty() && !sub->get_group().empty()) all.push_back(sub);
  }
  return all;
}

std::string options_text(const CLI::App& app) {
  const auto formatter = std::dynamic_pointer_cast<CLI::Formatter>(app.get_formatter());
  std::string text;
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : app.get_options()) {
      if (option->get_group().empty() || option->get_positional() != positional) continue;
      const std::string name = positional ? option->get_name(true) : option->get_name(false, true);
      text += ".TP\n.B " + plain(name);
      if (formatter != nullptr) {
        if (const std::string more = formatter->make_option_opts(option); !more.empty()) text += "\\fR" + plain(more);
      }
      text += fmt::format("\n{}\n",
                          plain(option->get_description().empty() ? "See the examples." : option->get_description()));
    }
  }
  return text;
}

void append_command(std::string& page, const CLI::App& app, const std::string& name) {
  page += fmt::format(".SH SYNOPSIS\n.B {}\n", plain(name));
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    const std::string word = plain(option->get_name(true));
    page += option->get_required() ? fmt::format(".I {}\n", word) : fmt::format("[\\fI{}\\fR]\n", word);
  }
  if (!commands_of(app).empty()) page += app.get_require_subcommand_min() > 0 ? ".I command\n" : "[\\fIcommand\\fR]\n";
  page += fmt::format("[\\fIoption\\fR ...]\n.SH DESCRIPTION\n{}.\n", plain(app.get_description()));
  if (const std::string footer = app.get_footer(); !footer.empty())
    page += fmt::format(".PP\n.nf\n{}\n.fi\n", plain(footer));
  if (const std::string options = options_text(app); !options.empty()) page += ".SH OPTIONS\n" + options;
}

}  // namespace

int write_manual(const CLI::App& app, const std::string& folder) {
  const std::string head = " 1 \"\" \"sentree " SENTREE_VERSION "\" \"Sentree\"\n.SH NAME\n";
  std::map<std::string, std::string> pages;
  std::string& top = pages["sentree.1"];
  top = fmt::format(".TH SENTREE{}sentree \\- design, execute, monitor and verify robot behaviours\n", head);
  append_command(top, app, "sentree");
  top += ".SH COMMANDS\n";
  for (const CLI::App* sub : commands_of(app)) {
    const std::string name = "sentree-" + sub->get_name();
    top += fmt::format(".TP\n.BR {} (1)\n{}.\n", plain(name), plain(sub->get_description()));
    std::string& page = pages[name + ".1"];
    std::string title = name;
    for (char& c : title) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    page = fmt::format(".TH {}{}{} \\- {}\n", title, head, plain(name), plain(first_lower(sub->get_description())));
    append_command(page, *sub, "sentree " + sub->get_name());
    for (const CLI::App* below : commands_of(*sub)) {
      page +=
          fmt::format(".SH \"SENTREE {}\"\n{}.\n{}", plain(fmt::format("{} {}", sub->get_name(), below->get_name())),
                      plain(below->get_description()), options_text(*below));
    }
    page += ".SH \"SEE ALSO\"\n.BR sentree (1)\n";
  }
  for (const auto& [file, text] : pages) {
    if (const auto done = text::write_file(std::filesystem::path(folder) / file, text); !done) {
      say(to_string(done.error()));
      return kEnvironment;
    }
  }
  return kOk;
}

}  // namespace sentree::cli
