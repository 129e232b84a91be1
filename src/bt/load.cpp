#include "sentree/bt/load.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "sentree/bt/detail/loader.h"
#include "sentree/bt/detail/values.h"
#include "sentree/text/file.h"

namespace sentree::bt {

using text::XmlElement;

void Loader::report(Severity severity, std::string code, std::string message, SourceSpan span) {
  if (diagnostics_.size() >= kFindingsMax) {
    // An error that is not listed is one all the same.
    if (severity != Severity::kError || unlisted_error_) return;
    unlisted_error_ = true;
    code = "bt.too-many-findings";
    message = fmt::format("there are more than {} findings; the rest is not listed", kFindingsMax);
  }
  diagnostics_.push_back({severity, std::move(code), std::move(message), std::move(span)});
}

void Loader::settle_port(PortInfo& info) const {
  if (info.type != nullptr && !info.type->strong()) info.type = nullptr;
  if (info.type == nullptr || info.type->kind == PortType::Class::kString || !info.default_text) return;
  if (!entry_name(*info.default_text) && !value_of_text(*model_, *info.type, *info.default_text))
    info.default_text.reset();
}

std::uint32_t Loader::string(std::string_view text) {
  if (const std::uint32_t known = model_->find_string(text); known != kNone) return known;
  const auto index = static_cast<std::uint32_t>(model_->strings.size());
  model_->strings.emplace_back(text);
  model_->string_index.add(index,
                           [this](std::uint32_t one) { return std::hash<std::string_view>()(model_->strings[one]); });
  return index;
}

bool Loader::read_document(std::string xml, std::string file, const std::filesystem::path& path, bool found) {
  if (xml.size() > kIncludeBytesMax) {
    error("bt.too-large", fmt::format("the file has more than {} bytes", kIncludeBytesMax), {file, 0, 0, 0});
    return false;
  }
  auto parsed = text::XmlDocument::parse(std::move(xml), file, {.lenient = true});
  if (!parsed) {
    diagnostics_.push_back(std::move(parsed.error()));
    return false;
  }
  diagnostics_.insert(diagnostics_.end(), parsed->warnings().begin(), parsed->warnings().end());
  model_->files.push_back(std::move(file));
  model_->lines.push_back(parsed->lines());
  const auto index = static_cast<std::uint32_t>(documents_.size());
  documents_.push_back(std::make_unique<Document>(Document{std::move(*parsed), path, index, found}));
  read_root(index);
  return true;
}

int Loader::detect_format(const XmlElement& root) {
  const auto format = root.attribute("BTCPP_format");
  if (!format) return 3;
  if (*format == "3" || *format == "4") return *format == "3" ? 3 : 4;
  missing("bt.bad-format", fmt::format("BTCPP_format is \"{}\"; 3 and 4 are known", *format),
          root.attribute_value_span("BTCPP_format"));
  return 4;
}

void Loader::read_root(std::uint32_t document) {
  const XmlElement root = documents_[document]->xml.root();
  if (root.name() != "root") {
    error("bt.not-a-tree", fmt::format("the root element is <{}>; a tree's is <root>", root.name()), root.span());
    return;
  }
  const int format = detect_format(root);
  if (document == 0) {
    model_->format = format;
  } else if (format != model_->format) {
    warn("bt.mixed-formats",
         fmt::format("this file is of format {} and runs with the semantics of format {}, the including file's", format,
                     model_->format),
         root.span());
  }
  // Models first: they say what the nodes of the trees are.
  for (XmlElement child = root.first_child(); child; child = child.next_sibling()) {
    if (child.name() == "TreeNodesModel") read_models(child);
  }
  for (XmlElement child = root.first_child(); child; child = child.next_sibling()) {
    const std::string_view name = child.name();
    if (name == "BehaviorTree") {
      read_tree(document, child);
    } else if (name == "include") {
      read_include(document, child);
    } else if (name != "TreeNodesModel" && !is_metadata(name) && name.find(":") == std::string_view::npos) {
      static const std::vector<std::string> kKnown = {"BehaviorTree", "TreeNodesModel", "include"};
      warn("bt.unknown-element",
           fmt::format("<{}> inside <root> is kept and means nothing{}", name, did_you_mean(name, kKnown)),
           child.span());
    }
  }
}

void Loader::read_tree(std::uint32_t document, const XmlElement& element) {
  const auto id = element.attribute("ID");
  std::string name(id.value_or(""));
  const bool named = id && !id->empty();
  if (!named && !definitions_.empty() && definition_index_.contains("")) {
    error("bt.missing-id", "a BehaviorTree needs an ID when there are several", element.span());
    return;
  }
  const auto index = static_cast<std::uint32_t>(definitions_.size());
  const auto [place, added] = definition_index_.try_emplace(name, index);
  if (!added) {
    error("bt.duplicate-tree",
          fmt::format("there are two BehaviorTrees \"{}\"; the other is at {}", name,
                      to_string(definitions_[place->second].element.span())),
          element.attribute_value_span("ID"));
    return;
  }
  Definition definition;
  definition.id = std::move(name);
  definition.element = element;
  definition.document = document;
  definitions_.push_back(std::move(definition));
}

void Loader::read_models(const XmlElement& models) {
  for (XmlElement element = models.first_child(); element; element = element.next_sibling()) {
    const std::string_view tag = element.name();
    const auto id = element.attribute("ID");
    if (!id || id->empty()) {
      error("bt.missing-id", fmt::format("<{}> in the TreeNodesModel needs an ID", tag), element.span());
      continue;
    }
    Manifest manifest;
    manifest.id = std::string(*id);
    if (tag == "Action") {
      manifest.category = Category::kAction;
    } else if (tag == "Condition") {
      manifest.category = Category::kCondition;
    } else if (tag == "Control") {
      manifest.category = Category::kControl;
    } else if (tag == "Decorator") {
      manifest.category = Category::kDecorator;
    } else if (tag == "SubTree" || tag == "SubTreePlus") {
      manifest.category = Category::kSubTree;
    } else {
      static const std::vector<std::string> kKnown = {"Action", "Condition", "Control", "Decorator", "SubTree"};
      warn("bt.unknown-element",
           fmt::format("<{}> in the TreeNodesModel means nothing{}", tag, did_you_mean(tag, kKnown)), element.span());
      continue;
    }
    for (XmlElement port = element.first_child(); port; port = port.next_sibling()) {
      const std::string_view kind = port.name();
      PortInfo info;
      if (kind == "input_port") {
        info.direction = PortDirection::kInput;
      } else if (kind == "output_port") {
        info.direction = PortDirection::kOutput;
      } else if (kind == "inout_port") {
        info.direction = PortDirection::kInOut;
      } else {
        continue;  // MetadataFields, description and the like.
      }
      const auto name = port.attribute("name");
      if (!name || name->empty()) {
        error("bt.missing-name", fmt::format("<{}> of \"{}\" needs a name", kind, manifest.id), port.span());
        continue;
      }
      if (manifest.ports.size() >= kPortsMax) {
        error("bt.too-large", fmt::format("\"{}\" has more than {} ports", manifest.id, kPortsMax), port.span());
        break;
      }
      info.name = std::string(*name);
      const bool twice = std::any_of(manifest.ports.begin(), manifest.ports.end(),
                                     [&info](const PortInfo& other) { return other.name == info.name; });
      if (twice) {
        error("bt.duplicate-port", fmt::format("port \"{}\" of \"{}\" is declared twice", info.name, manifest.id),
              port.span());
        continue;
      }
      const std::string_view type = port.attribute("type").value_or("");
      info.type = type_named(type);
      info.declared_type = std::string(type);
      if (const auto value = port.attribute("default")) info.default_text = std::string(*value);
      settle_port(info);
      info.description = port.text();
      manifest.ports.push_back(std::move(info));
    }
    if (manifest.category == Category::kSubTree) {
      subtree_ports_[manifest.id] = {std::move(manifest.ports), element.span()};
      continue;
    }
    manifest.external = manifest.category == Category::kAction || manifest.category == Category::kCondition;
    manifest.kind = manifest.category == Category::kCondition ? Kind::kExternalCondition : Kind::kExternalAction;
    const std::string key = manifest.id;
    if (!declared_.try_emplace(key, std::move(manifest)).second) {
      warn("bt.duplicate-model", fmt::format("\"{}\" is declared twice in the TreeNodesModel; the first counts", key),
           element.span());
    }
  }
}

void Loader::read_include(std::uint32_t document, const XmlElement& element) {
  const auto given = element.attribute("path");
  if (!given || given->empty()) {
    error("bt.missing-path", "<include> needs a path", element.span());
    return;
  }
  const SourceSpan place = element.attribute_value_span("path");
  if (!options_.read_file) {
    missing_files_ = true;
    missing("bt.include-refused", fmt::format("<include path=\"{}\">: files cannot be read here", *given), place);
    return;
  }
  std::filesystem::path path = documents_[document]->path.parent_path() / std::string(*given);
  if (const auto package = element.attribute("ros_pkg")) {
    if (!options_.find_package) {
      missing_files_ = true;
      missing("bt.include-refused", fmt::format("ROS package \"{}\" cannot be looked up here", *package), place);
      return;
    }
    auto folder = options_.find_package(*package);
    if (!folder) {
      missing_files_ = true;
      missing(folder.error().code, folder.error().message, place);
      return;
    }
    path = *folder / std::string(*given);
  }
  if (open_files_.contains(path.lexically_normal().string())) {
    error("bt.include-cycle", fmt::format("\"{}\" includes itself", path.lexically_normal().string()), place);
    return;
  }
  if (open_files_.size() > kIncludeDepthMax) {
    error("bt.too-deep", fmt::format("files include each other more than {} levels deep", kIncludeDepthMax), place);
    return;
  }
  if (const auto read = read_other(path, place, false); !read) {
    missing_files_ = true;
    missing(read.error().code, read.error().message, place);
  }
}

Result<void> Loader::read_other(const std::filesystem::path& given, const SourceSpan& place, bool found) {
  const std::filesystem::path path = given.lexically_normal();
  const std::string key = path.string();
  // A file that several others name is read once.
  if (open_files_.contains(key) || !read_files_.insert(key).second) return {};
  if (read_files_.size() > kIncludesMax) {
    error("bt.too-large", fmt::format("more than {} files are included", kIncludesMax), place);
    return {};
  }
  auto content = options_.read_file(path);
  if (!content) return fail(content.error().code, fmt::format("\"{}\": {}", key, content.error().message), place);
  include_bytes_ += content->size();
  if (include_bytes_ > kIncludeBytesMax) {
    error("bt.too-large", fmt::format("the included files have more than {} bytes together", kIncludeBytesMax), place);
    return {};
  }
  open_files_.insert(key);
  read_document(std::move(*content), key, path, found);
  open_files_.erase(key);
  return {};
}

std::uint32_t Loader::find_definition(std::string_view id, const SourceSpan& place) {
  if (const auto known = definition_index_.find(id); known != definition_index_.end()) return known->second;
  if (!options_.find_tree || !options_.read_file) return kNone;
  const auto path = options_.find_tree(id);
  if (!path) return kNone;
  if (const auto read = read_other(*path, place, true); !read) missing(read.error().code, read.error().message, place);
  const auto now = definition_index_.find(id);
  return now != definition_index_.end() ? now->second : kNone;
}

std::uint32_t Loader::likely_main() const {
  std::set<std::string, std::less<>> used;
  const auto visit = [&](const XmlElement& element, const auto& self) -> void {
    for (XmlElement e = element.first_child(); e; e = e.next_sibling()) {
      used.emplace(e.name().starts_with("SubTree") ? e.attribute("ID").value_or("") : e.name());
      self(e, self);  // The parser bounds nesting.
    }
  };
  for (const Definition& definition : definitions_) visit(definition.element, visit);
  for (std::uint32_t i = 0; i < definitions_.size(); ++i) {
    if (definitions_[i].document == 0 && !used.contains(definitions_[i].id)) return i;
  }
  return 0;
}

std::uint32_t Loader::main_definition(const XmlElement& root) {
  std::vector<std::string> ids;
  for (const Definition& definition : definitions_) ids.push_back(definition.id);
  if (!options_.main_tree.empty()) {
    if (const auto found = find_definition(options_.main_tree, root.span()); found != kNone) return found;
    std::string hint = did_you_mean(options_.main_tree, ids);
    constexpr std::size_t kNamedMax = 8;
    if (hint.empty() && !ids.empty() && ids.size() <= kNamedMax)
      hint = fmt::format("; there is \"{}\"", fmt::join(ids, "\", \""));
    if (std::string place = where(options_.main_tree); !place.empty()) hint = std::move(place);
    error("bt.unknown-tree", fmt::format("there is no BehaviorTree \"{}\"{}", options_.main_tree, hint), root.span());
    return kNone;
  }
  if (const auto wanted = root.attribute("main_tree_to_execute")) {
    const SourceSpan place = root.attribute_value_span("main_tree_to_execute");
    if (const auto found = find_definition(*wanted, place); found != kNone) return found;
    const bool elsewhere = options_.partial && missing_files_;
    report(elsewhere ? Severity::kWarning : Severity::kError, "bt.unknown-tree",
           fmt::format("main_tree_to_execute is \"{}\", and there is no such BehaviorTree{}{}", *wanted,
                       did_you_mean(*wanted, ids), where(*wanted)),
           place);
    return elsewhere && !definitions_.empty() ? likely_main() : kNone;
  }
  std::vector<std::uint32_t> own;
  for (std::uint32_t i = 0; i < definitions_.size(); ++i) {
    if (definitions_[i].document == 0) own.push_back(i);
  }
  if (own.size() == 1) return own.front();
  if (definitions_.size() == 1) return 0;
  if (options_.partial && !definitions_.empty()) {
    const std::uint32_t likely = likely_main();
    warn("bt.no-main-tree",
         fmt::format("which of the {} BehaviorTrees is the main one? Say so by main_tree_to_execute; here it is \"{}\"",
                     definitions_.size(), definitions_[likely].id),
         root.span());
    return likely;
  }
  if (const auto nodes = declared_.size(); options_.partial && nodes > 0 && definitions_.empty()) {
    report(Severity::kNote, "bt.palette", fmt::format("a palette of {} {}", nodes, nodes == 1 ? "node" : "nodes"),
           root.span());
    return kNone;
  }
  report(options_.partial && missing_files_ ? Severity::kWarning : Severity::kError,
         definitions_.empty() ? "bt.no-tree" : "bt.no-main-tree",
         definitions_.empty()
             ? "there is no <BehaviorTree>"
             : fmt::format("which of the {} BehaviorTrees is the main one? Say so by main_tree_to_execute",
                           definitions_.size()),
         root.span());
  return kNone;
}

void Loader::start_entries() {
  for (const StartEntry& entry : options_.entries) {
    const std::uint32_t name = string(entry.name);
    if (model_->find_cell(0, name) == kNone) {
      std::vector<std::string> known;
      std::string way = "";
      for (const Cell& one : model_->cells) {
        if (one.scope == 0) known.push_back(model_->strings[one.name]);
        if (one.name == name && one.parent == kNone && way.empty())
          way = fmt::format("; SubTree \"{0}\" has one of its own: give it {1}=\"{{{1}}}\", or _autoremap=\"true\"",
                            model_->scopes[one.scope].path, entry.name);
      }
      warn("bt.unused-entry",
           fmt::format("nothing in tree \"{}\" names entry \"{}\"{}", model_->id, entry.name,
                       way.empty() ? did_you_mean(entry.name, known) : way),
           entry.span);
    }
    Constant start{cell(0, name), Datum{entry.value, nullptr}, nullptr, string("")};
    const EntryUse& use = entry_use(start.cell);
    const Datum given = start.datum;
    start.type = use.strong;
    if (use.strong != nullptr && !convert(*model_, *use.strong, given, start.datum)) {
      error("bt.entry-type",
            fmt::format("entry \"{}\" begins with {}, which is no {}, as {} has it", entry.name, shown(given),
                        use.strong->name, declared_by(use)),
            entry.span);
    }
    model_->constants.push_back(std::move(start));
  }
}

void Loader::box_main(const XmlElement& root) {
  model_->id = root.attribute("main_tree_to_execute").value_or("");
  model_->scopes.emplace_back();
  Definition none;
  DefinedNode box;
  box.element = root;
  given_.clear();
  define_closed(none, box, model_->id);
  model_->trees.push_back({kNoNode, 0, box.data});
  bind_special(box, add_node(none, box, kNoNode, 0), 0);
}

Loaded<Tree> Loader::load(std::string xml, const std::string& file) {
  Loaded<Tree> loaded;
  if (options_.registry != nullptr) {
    diagnostics_ = options_.registry->problems();
    model_->enums = options_.registry->enums();
    model_->casts = options_.registry->casts();
  }
  const std::filesystem::path path = std::filesystem::path(file).lexically_normal();
  open_files_.insert(path.string());
  if (read_document(std::move(xml), file, path)) {
    const XmlElement root = documents_[0]->xml.root();
    const std::uint32_t main = root.name() == "root" ? main_definition(root) : kNone;
    if (main != kNone) {
      model_->id = definitions_[main].id;
      model_->scopes.emplace_back();
      const bool complete = instantiate(main, kNoNode, 0, 0);
      if (complete) {
        check_substitutions(root);
        check_leaf_names();
        name_scopes();
        start_entries();
      }
    }
    std::sort(model_->named.begin(), model_->named.end());
    model_->named.erase(std::unique(model_->named.begin(), model_->named.end()), model_->named.end());
    if (main == kNone && missing_files_ && !has_errors(diagnostics_)) box_main(root);
    if (root.name() == "root") check_definitions();
    if (main != kNone && !has_errors(diagnostics_)) check_entries();
  }
  sort_by_place(diagnostics_);
  loaded.diagnostics = std::move(diagnostics_);
  if (!has_errors(loaded.diagnostics) && !model_->nodes.empty()) {
    note_ticks();
    model_->nodes.shrink_to_fit();
    model_->infos.shrink_to_fit();
    model_->children.shrink_to_fit();
    model_->text.shrink_to_fit();
    model_->bindings.shrink_to_fit();
    model_->cells.shrink_to_fit();
    model_->declared.shrink_to_fit();
    model_->named.shrink_to_fit();
    model_->conditions.shrink_to_fit();
    model_->users.shrink_to_fit();
    model_->unwritten.shrink_to_fit();
    loaded.value.emplace(std::move(model_));
  }
  return loaded;
}

Result<std::filesystem::path> find_ros_package(std::string_view package,
                                               const std::vector<std::filesystem::path>& folders) {
  std::vector<std::filesystem::path> all = folders;
  for (const char* const variable : {"AMENT_PREFIX_PATH", "ROS_PACKAGE_PATH"}) {
    const char* const value = std::getenv(variable);
    std::string_view rest = value != nullptr ? value : "";
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(':'), rest.size());
      if (end > 0) all.emplace_back(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  std::string tried;
  const bool is_name = !package.empty() && package.find_first_of("/\\") == std::string_view::npos && package != "..";
  for (const std::filesystem::path& folder : all) {
    for (const std::filesystem::path& place : {folder / "share" / package, folder / package}) {
      std::error_code error;
      if (is_name && std::filesystem::is_directory(place, error)) return place;
      tried += (tried.empty() ? "" : ", ") + place.string();
    }
  }
  return fail("bt.no-package", fmt::format("there is no ROS package \"{}\"{}", package,
                                           all.empty() ? "; AMENT_PREFIX_PATH says where packages are, and is empty"
                                                       : "; tried " + tried));
}

Loaded<Tree> load(std::string xml, const LoadOptions& options, const std::string& file) {
  return Loader(options).load(std::move(xml), file);
}

Loaded<Tree> load_file(const std::filesystem::path& path, LoadOptions options) {
  auto content = text::read_file(path);
  if (!content) return {std::nullopt, {std::move(content.error())}};
  if (!options.read_file) {
    options.read_file = [](const std::filesystem::path& included) { return text::read_file(included); };
  }
  if (!options.find_package) {
    options.find_package = [](std::string_view package) { return find_ros_package(package); };
  }
  return load(std::move(*content), options, path.string());
}

}  // namespace sentree::bt
