#include "sentree/cli/completion.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "sentree/bt/load.h"
#include "sentree/idl/conform.h"
#include "sentree/processes/control.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/plan.h"
#include "sentree/project/project.h"
#include "sentree/rpc/middleware.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"
#include "sentree/text/xml.h"

namespace sentree::cli {

namespace {

using Candidate = Completion::Candidate;
using Candidates = std::vector<Candidate>;

/// A running mission that does not answer is not waited for at the prompt.
constexpr Duration kControlDeadline = std::chrono::milliseconds(300);

/// The command line as far as it is typed.
struct Line {
  const CLI::App* command = nullptr;  ///< The subcommand; null while it is being typed.
  const CLI::Option* value_of = nullptr;
  std::vector<std::string> positionals;  ///< Before the word to complete.
  std::map<std::string, std::string> options;
  std::string prefix;  ///< "--tree=" where the value follows in the same word.
  std::string word;
};

const CLI::Option* find_option(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional() && option->check_name(name)) return option;
  }
  return nullptr;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

Line read_line(const CLI::App& app, const std::vector<std::string>& words) {
  Line line;
  if (!words.empty()) line.word = words.back();
  if (words.size() < 2) return line;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (command->get_name() == words.front()) line.command = command;
  }
  if (line.command == nullptr) return line;
  for (std::size_t i = 1; i + 1 < words.size(); ++i) {
    const std::string& word = words[i];
    const std::size_t equals = word.find('=');
    if (word.size() < 2 || word.front() != '-') {
      line.positionals.push_back(word);
    } else if (equals != std::string::npos) {
      line.options[word.substr(0, equals)] = word.substr(equals + 1);
    } else if (const CLI::Option* option = find_option(*line.command, word);
               option != nullptr && takes_value(*option)) {
      if (i + 2 == words.size())
        line.value_of = option;
      else
        line.options[word] = words[++i];
    }
  }
  if (const std::size_t equals = line.word.find('=');
      line.value_of == nullptr && line.word.starts_with("--") && equals != std::string::npos) {
    line.value_of = find_option(*line.command, line.word.substr(0, equals));
    line.prefix = line.word.substr(0, equals + 1);
    line.word.erase(0, equals + 1);
  }
  return line;
}

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

Candidates commands(const CLI::App& app) {
  Candidates all;
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_group().empty()) all.push_back({command->get_name(), first_line(command->get_description())});
  }
  return all;
}

Candidates options(const CLI::App& command) {
  Candidates all;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_positional()) continue;
    for (const std::string& name : option->get_lnames()) all.push_back({"--" + name, option->get_description()});
  }
  return all;
}

/// What an option that allows only some words allows: CLI11 says it as "TEXT:{a,b}".
Candidates members(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{');
  const std::size_t close = type.find('}');
  Candidates all;
  if (open == std::string::npos || close == std::string::npos) return all;
  for (const std::string& word : CLI::detail::split(type.substr(open + 1, close - open - 1), ','))
    all.push_back({word, ""});
  return all;
}

std::string option_or(const Line& line, const std::string& name, const std::string& otherwise) {
  const auto found = line.options.find(name);
  return found != line.options.end() ? found->second : otherwise;
}

std::optional<project::Project> project(const Line& line) {
  auto loaded = project::load_project(line.positionals.empty() ? "." : line.positionals.front());
  return std::move(loaded.value);
}

Candidates scenarios(const Line& line) {
  Candidates all;
  if (const auto loaded = project(line)) {
    for (const auto& file : project::scenario_files(*loaded)) all.push_back({file.stem().string(), ""});
  }
  return all;
}

std::optional<bt::Tree> mission(const project::Project& project) {
  bt::Registry registry;
  return project::load_mission(project, registry, project::TreePurpose::kLook).value;
}

Candidates leaves(const Line& line) {
  Candidates all;
  const auto loaded = project(line);
  const auto tree = loaded ? mission(*loaded) : std::nullopt;
  if (!tree) return all;
  for (const bt::NodeId leaf : tree->external_leaves()) {
    const std::string id(tree->registration(leaf));
    if (std::none_of(all.begin(), all.end(), [&](const Candidate& c) { return c.word == id; })) all.push_back({id, ""});
  }
  return all;
}

Candidates trees(const Line& line) {
  if (line.positionals.empty()) return {};
  std::filesystem::path file = line.positionals.front();
  std::error_code error;
  if (std::filesystem::is_directory(file, error)) {
    const auto loaded = project(line);
    if (!loaded) return {};
    file = loaded->folder / loaded->mission.path;
  }
  const auto source = text::read_file(file);
  const auto document =
      source ? text::XmlDocument::parse(*source, {}, {.lenient = true}) : tl::unexpected(source.error());
  Candidates all;
  if (!document) return all;
  for (const text::XmlElement& tree : document->root().children()) {
    if (tree.name() == "BehaviorTree") all.push_back({std::string(tree.attribute("ID").value_or("")), ""});
  }
  return all;
}

/// The methods of an interface that the line names, as `offered` lists those of a service.
std::optional<Value> named_interface(const Line& line) {
  const auto [name, of] = project::interface_name(option_or(line, "--interface", ""));
  if (name.empty()) return std::nullopt;
  std::error_code error;
  const auto file = std::filesystem::exists(name, error) ? std::filesystem::path(name)
                                                         : project::find_interface("interfaces", name).value_or("");
  const auto schema = project::load_interface(file, name);
  const idl::ServicePtr service = schema.ok() ? schema.value->service(of) : nullptr;
  if (service == nullptr) return std::nullopt;
  List methods;
  for (const idl::Method* method : service->methods) methods.push_back(idl::signature(*method));
  return Value(List{Map{{"name", ""}, {"at", line.positionals.front()}, {"methods", std::move(methods)}}});
}

/// What the running mission offers, as `sentree call` lists it.
std::optional<Value> offered(const Line& line) {
  const auto client = processes::connect_control(std::atoi(option_or(line, "--run", "0").c_str()));
  if (!client) return std::nullopt;
  const auto services = (*client)->call("services", Map(), std::chrono::steady_clock::now() + kControlDeadline);
  if (!services) return std::nullopt;
  auto list = text::parse_json(services->text());
  if (!list) return std::nullopt;
  return std::move(*list);
}

/// Runs that have a page, or will.
Candidates attachable() {
  Candidates all;
  for (const processes::RunningRun& run : processes::running_runs(kControlDeadline)) {
    if (run.has_page) all.push_back({std::to_string(run.pid), run.scenario});
  }
  return all;
}

/// "bool setBatteryCharge(double percent)" → "setBatteryCharge" and {"percent="}.
struct Method {
  std::string name;
  Candidates parameters;
};
Method parse_signature(const std::string& signature) {
  Method method;
  const std::size_t open = signature.find('(');
  const std::size_t close = signature.rfind(')');
  if (open == std::string::npos || close == std::string::npos || close < open) return method;
  const std::size_t blank = signature.rfind(' ', open);
  const std::size_t begin = blank == std::string::npos ? 0 : blank + 1;
  method.name = signature.substr(begin, open - begin);
  for (std::string parameter : CLI::detail::split(signature.substr(open + 1, close - open - 1), ',')) {
    CLI::detail::trim(parameter);
    const std::size_t last = parameter.rfind(' ');
    if (last != std::string::npos)
      method.parameters.push_back({parameter.substr(last + 1) + "=", parameter.substr(0, last)});
  }
  return method;
}

/// The ports of a network that a word begins to name; or only those that data are read from.
Candidates network_words(const std::string& network, bool only_data) {
  Candidates all;
  const auto address = rpc::Address::parse(network);
  if (!address) return all;
  const auto listed = rpc::middleware_of(*address).list(
      *address, std::chrono::duration_cast<std::chrono::milliseconds>(kControlDeadline));
  if (!listed) return all;
  for (const rpc::NetworkEntry& entry : *listed) {
    // Ports of YARP by their names, topics of ROS by what the network says.
    if (!only_data || entry.name.ends_with(":o") || entry.kind.starts_with("topic "))
      all.push_back({entry.at, entry.kind});
  }
  return all;
}

Candidates call_words(const Line& line) {
  Candidates all;
  auto services = line.positionals.empty() ? std::nullopt : named_interface(line);
  if (!services) services = offered(line);
  if (!services || services->as_list() == nullptr) return all;
  for (const Value& service : *services->as_list()) {
    const Value* name = service.find("name");
    const Value* methods = service.find("methods");
    if (name == nullptr || methods == nullptr || methods->as_list() == nullptr) continue;
    if (line.positionals.empty()) {
      const Value* interface = service.find("interface");
      all.push_back({std::string(name->text()), interface != nullptr ? std::string(interface->text()) : ""});
      continue;
    }
    const Value* at = service.find("at");
    const std::string& asked = line.positionals.front();
    if (name->text() != asked && (at == nullptr || at->text() != asked)) continue;
    for (const Value& signature : *methods->as_list()) {
      const std::string text(signature.text());
      const Method method = parse_signature(text);
      if (line.positionals.size() == 1) {
        all.push_back({method.name, text});
      } else if (line.positionals[1] == method.name) {
        all.insert(all.end(), method.parameters.begin(), method.parameters.end());
      }
    }
  }
  return all;
}

void files(Completion& completion, std::vector<std::string> endings) {
  completion.files = Completion::Files::kAll;
  completion.endings = std::move(endings);
}

void value(const Line& line, Completion& completion) {
  const std::string name = line.value_of->get_single_name();
  completion.candidates = members(*line.value_of);
  if (!completion.candidates.empty()) return;
  if (name == "attach") completion.candidates = attachable();
  if (name == "scenario") completion.candidates = scenarios(line);
  if (name == "on") {
    completion.candidates = {{"yarp:", "ports that the name server of YARP knows"},
                             {"ros:", "topics, services and actions in the domain of ROS 2"}};
  }
  if (name == "tree") completion.candidates = trees(line);
  if (name == "against") files(completion, {"mcap"});
  if (name == "output") files(completion, {});
  if (name == "into") files(completion, {"xml"});
  if (name == "world") files(completion, {"yaml"});
  if (name == "interface") files(completion, {"thrift"});
  if (name == "project") files(completion, {"yaml"});
}

void positional(const Line& line, Completion& completion) {
  const std::string name = line.command->get_name();
  const std::size_t place = line.positionals.size();
  const auto colon = line.word.find(':');
  const bool of_network = colon != std::string::npos && (name == "call" || name == "ping" || name == "echo");
  if (of_network && place == 0) {
    completion.candidates = network_words(line.word.substr(0, colon + 1), name == "echo");
  } else if (name == "call") {
    completion.candidates = call_words(line);
  } else if (name == "fmt") {
    files(completion, {"xml", "scxml"});
  } else if ((name == "ping" || name == "echo") && place == 0) {
    completion.candidates = call_words(line);
    if (name == "echo") {
      for (Candidate& service : completion.candidates) service.word += ".*";
    }
  } else if (name == "check" && place == 0) {
    files(completion, {"yaml", "xml", "scxml", "req", "thrift"});
  } else if ((name == "studio" || name == "info" || name == "replay" || name == "export" || name == "report" ||
              name == "bug-report") &&
             place == 0) {
    files(completion, {"mcap"});
  } else if (name == "diff" && place < 2) {
    files(completion, {"xml"});
  } else if (name == "chart" && place == 0) {
    files(completion, {"scxml"});
  } else if (name == "graph" && place == 0) {
    files(completion, {"xml", "scxml", "yaml"});
  } else if (name == "model" && place == 0) {
    files(completion, {"xml", "yaml"});
  } else if (name == "skill" && place == 1) {
    completion.candidates = leaves(line);
  } else if (name == "init" && place == 0) {
    completion.files = Completion::Files::kFolders;
  } else if (name == "import" && place == 0) {
    files(completion, {"xml"});
  } else if (name == "component" && place == 0) {
    completion.candidates = {{"sim", "the simulated robot"}};
  } else if (place == 0) {
    // Any other command: the words that its argument allows, else a project.
    for (const CLI::Option* option : line.command->get_options()) {
      if (!option->get_positional()) continue;
      completion.candidates = members(*option);
      if (completion.candidates.empty()) files(completion, {"yaml"});
      return;
    }
  }
}

}  // namespace

Completion complete(const CLI::App& app, const std::vector<std::string>& words) {
  const Line line = read_line(app, words);
  Completion completion;
  if (line.command == nullptr) {
    if (words.size() < 2) completion.candidates = line.word.starts_with('-') ? options(app) : commands(app);
  } else if (line.value_of != nullptr) {
    value(line, completion);
  } else if (line.word.starts_with('-')) {
    completion.candidates = options(*line.command);
  } else {
    positional(line, completion);
  }
  std::erase_if(completion.candidates, [&](const Candidate& c) { return !c.word.starts_with(line.word); });
  for (Candidate& candidate : completion.candidates) candidate.word.insert(0, line.prefix);
  return completion;
}

std::string to_lines(const Completion& completion) {
  std::string lines;
  for (const Candidate& candidate : completion.candidates) {
    lines += candidate.word;
    if (!candidate.description.empty()) lines += "\t" + first_line(candidate.description);
    lines += "\n";
  }
  if (completion.files == Completion::Files::kFolders) lines += ":folders\n";
  if (completion.files == Completion::Files::kAll) {
    lines += ":files";
    for (const std::string& ending : completion.endings) lines += " " + ending;
    lines += "\n";
  }
  return lines;
}

std::string completion_script(const std::string& shell) {
  // bash breaks words at '=' and ':'; ours are those between blanks, so the part before the last break is cut off
  // again.
  if (shell == "bash") {
    return R"sh(# Completion for bash: source <(sentree completion bash)
_sentree() {
  local typed=${COMP_LINE:0:COMP_POINT} line ending file cur cut
  local -a words
  read -ra words <<<"$typed"
  [[ $typed == *' ' ]] && words+=("")
  cur=${words[${#words[@]} - 1]}
  cut=${cur%"${cur##*[=:]}"}
  COMPREPLY=()
  while IFS= read -r line; do
    case $line in
      :folders) compopt -o filenames; while IFS= read -r file; do COMPREPLY+=("$file"); done < <(compgen -d -- "$cur") ;;
      :files*)
        compopt -o filenames
        while IFS= read -r file; do
          [[ -d $file || $line == :files ]] && COMPREPLY+=("$file") && continue
          for ending in ${line#:files}; do [[ $file == *.$ending ]] && COMPREPLY+=("$file"); done
        done < <(compgen -f -- "${cur#"$cut"}") ;;
      *)
        line=${line%%$'\t'*}
        [[ $line == *= ]] && compopt -o nospace
        COMPREPLY+=("${line#"$cut"}") ;;
    esac
  done < <("${words[0]}" __complete "${words[@]:1}" 2>/dev/null)
}
complete -F _sentree sentree
)sh";
  }
  if (shell == "zsh") {
    return R"sh(#compdef sentree
# Completion for zsh: sentree completion zsh >"${fpath[1]}/_sentree", or: source <(sentree completion zsh)
_sentree() {
  local line word
  local -a found open
  for line in "${(@f)$("${words[1]}" __complete "${(@)words[2,CURRENT]}" 2>/dev/null)}"; do
    case $line in
      '') ;;
      :folders) _files -/ ;;
      :files) _files ;;
      :files*) _files -g "*.(${(j:|:)${(s: :)line#:files }})" ;;
      *)
        word=${line%%$'\t'*}
        if [[ $word == *= ]]; then
          open+=("$word")
        elif [[ $line == *$'\t'* ]]; then
          found+=("${word//:/\\:}:${line#*$'\t'}")
        else
          found+=("${word//:/\\:}")
        fi ;;
    esac
  done
  (( ${#open} )) && compadd -S '' -a open
  (( ${#found} )) && _describe -t words 'sentree' found
}
if [[ $funcstack[1] == _sentree ]]; then _sentree "$@"; else compdef _sentree sentree; fi
)sh";
  }
  if (shell == "fish") {
    return R"sh(# Completion for fish: sentree completion fish | source
function __sentree_complete
    set -l typed (commandline -opc)
    set -l current (commandline -ct)
    for line in ($typed[1] __complete $typed[2..-1] "$current" 2>/dev/null)
        switch $line
            case ':folders'
                __fish_complete_directories "$current"
            case ':files'
                __fish_complete_path "$current"
            case ':files *'
                __fish_complete_directories "$current"
                for ending in (string split ' ' (string replace ':files ' '' -- $line))
                    for file in $current*.$ending
                        echo $file
                    end
                end
            case '*'
                echo $line
        end
    end
end
complete -c sentree -f -a '(__sentree_complete)'
)sh";
  }
  return "";
}

}  // namespace sentree::cli
