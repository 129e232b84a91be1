#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>

#include "sentree/bt/detail/loader.h"
#include "sentree/bt/detail/values.h"

// Elements of a BehaviorTree to the nodes of a definition: which node it is, its ports, conditions and scripts.

namespace sentree::bt {

using text::XmlAttribute;
using text::XmlElement;

namespace {

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

bool is_subtree_tag(std::string_view tag) { return tag == "SubTree" || tag == "SubTreePlus"; }

/// The children that are nodes.
std::size_t children_of(const XmlElement& element) {
  std::size_t count = 0;
  for (XmlElement e = element.first_child(); e; e = e.next_sibling()) count += is_metadata(e.name()) ? 0U : 1U;
  return count;
}

/// Ports that built-in nodes had in early releases of format 3.
bool was_port(std::string_view id, std::string_view port) {
  return (id == "Parallel" && port == "threshold") || (id == "SequenceStar" && port == "reset_on_failure");
}

bool has_port(const Ports& ports, std::string_view name) {
  return std::any_of(ports.begin(), ports.end(), [name](const PortInfo& port) { return port.name == name; });
}

}  // namespace

bool is_metadata(std::string_view tag) { return tag == "Metadata" || tag == "MetadataFields"; }

std::optional<std::string_view> entry_name(std::string_view text) {
  text = without_blanks(text);
  if (text.size() < 3 || text.front() != '{' || text.back() != '}') return std::nullopt;
  return without_blanks(text.substr(1, text.size() - 2));
}

std::uint32_t Loader::add_manifest(const Manifest& manifest) {
  const auto index = static_cast<std::uint32_t>(model_->manifests.size());
  model_->manifests.push_back(manifest);
  same_manifest_.emplace(std::tuple(manifest.id, manifest.kind, manifest.category), index);
  auto& names = port_names_.emplace_back();
  for (const PortInfo& port : manifest.ports) names.push_back(string(port.name));
  return index;
}

std::vector<std::string> Loader::known_ids() const {
  if (diagnostics_.size() >= kHintsMax) return {};
  std::vector<std::string> ids = options_.skills;
  ids.insert(ids.end(), {"Action", "Condition", "Control", "Decorator"});
  for (const Manifest& manifest : builtins(model_->format)) ids.push_back(manifest.id);
  for (const auto& [id, manifest] : declared_) ids.push_back(id);
  if (options_.palette != nullptr) {
    for (const auto& [id, model] : options_.palette->nodes()) ids.push_back(id);
  }
  if (options_.registry != nullptr) {
    for (const auto& [id, entry] : options_.registry->entries()) ids.push_back(id);
  }
  return ids;
}

std::vector<std::string> Loader::tree_ids() const {
  std::vector<std::string> ids;
  if (diagnostics_.size() >= kHintsMax) return ids;
  for (const Definition& other : definitions_) ids.push_back(other.id);
  return ids;
}

std::string Loader::hint(std::string_view name, const std::vector<std::string>& candidates) const {
  if (diagnostics_.size() >= kHintsMax) return {};
  // Where the very name is known, it is not a slip of the pen.
  if (std::find(candidates.begin(), candidates.end(), name) != candidates.end()) return {};
  return did_you_mean(name, candidates);
}

Manifest Loader::unknown_manifest(const XmlElement& element, std::string_view id, const SourceSpan& place) {
  const std::string_view tag = element.name();
  const std::size_t children = children_of(element);
  Manifest made;
  made.id = std::string(id);
  made.external = true;
  made.declared = false;
  const auto declared = declared_.find(id);
  if (declared != declared_.end()) made = declared->second;
  if (declared == declared_.end()) {
    made.category = tag == "Control" || (tag != "Decorator" && children > 1) ? Category::kControl
                    : tag == "Decorator" || children == 1                    ? Category::kDecorator
                                                                             : Category::kAction;
  }
  const bool leaf = made.category == Category::kAction;
  made.kind = leaf ? Kind::kExternalAction : Kind::kUnknown;
  made.children_min = leaf ? 0 : 1;
  made.children_max = made.category == Category::kControl ? 0xFFFFFFFFU : made.children_min;
  if (same_manifest_.contains(std::tuple(made.id, made.kind, made.category))) return made;
  const std::string what = made.category == Category::kControl ? "control node" : "decorator";
  if (declared != declared_.end()) {
    warn("bt.unknown-node",
         fmt::format("\"{}\" is declared as {}, and no C++ node of that ID is registered: it can be drawn, not run",
                     made.id, to_string(made.category)),
         place);
  } else {
    warn("bt.unknown-node",
         fmt::format("there is no node \"{}\"{}; it is taken for a {}, since nothing declares it: a TreeNodesModel or "
                     "a palette can",
                     made.id, hint(id, known_ids()), leaf ? "leaf" : what + " of unknown kind"),
         place);
  }
  return made;
}

const Manifest* Loader::known_manifest(std::string_view tag, std::string_view id, Manifest& made) {
  if (const Manifest* builtin = find_builtin(id, model_->format)) return builtin;
  if (options_.registry != nullptr) {
    if (const Registry::Entry* entry = options_.registry->find(id)) {
      made.id = entry->id;
      made.category = entry->category;
      made.kind = entry->loop ? Kind::kLoop : Kind::kUser;
      made.synchronous = entry->synchronous;
      made.ports = entry->ports;
      made.description = entry->description;
      made.behaviour = entry->behaviour;
      made.children_min = entry->category == Category::kControl || entry->category == Category::kDecorator ? 1 : 0;
      made.children_max = entry->category == Category::kControl ? 0xFFFFFFFFU : made.children_min;
      return &made;
    }
  }
  auto declared = declared_.find(id);
  if (declared == declared_.end() && options_.palette != nullptr) {
    if (const NodeModel* model = options_.palette->find(id)) {
      // From now on the same as if the file had declared it.
      declared = declared_.try_emplace(model->id).first;
      Manifest& fresh = declared->second;
      fresh.id = model->id;
      fresh.category = model->category;
      fresh.ports = model->ports;
      for (PortInfo& port : fresh.ports) settle_port(port);
      fresh.external = model->category == Category::kAction || model->category == Category::kCondition;
      fresh.kind = model->category == Category::kCondition ? Kind::kExternalCondition : Kind::kExternalAction;
    }
  }
  if (declared != declared_.end() && declared->second.external) {
    made = declared->second;
    return &made;
  }
  if (tag != "Action" && tag != "Condition") return nullptr;
  made.id = std::string(id);
  made.category = tag == "Action" ? Category::kAction : Category::kCondition;
  made.kind = tag == "Action" ? Kind::kExternalAction : Kind::kExternalCondition;
  made.external = true;
  made.declared = false;
  return &made;
}

const Manifest* Loader::guessed_manifest(const XmlElement& element, std::string_view id, bool is_explicit,
                                         Manifest& made) {
  const SourceSpan place = is_explicit ? element.attribute_value_span("ID") : element.span();
  const bool is_tree = definition_index_.contains(id);
  if (!is_explicit && is_tree && (model_->format == 3 || options_.partial)) {
    // Format 3 lets a SubTree be written as a node of its ID.
    if (model_->format != 3) {
      warn("bt.unknown-node", fmt::format("\"{}\" is a BehaviorTree; write <SubTree ID=\"{}\"/>", id, id), place);
    }
    return find_builtin("SubTree", model_->format);
  }
  std::optional<Category> kind;
  // Who writes an ID besides means the tag to be a kind: <Aciton ID="Go"/>.
  if (options_.skill_kind && !declared_.contains(id) && (is_explicit || !element.attribute("ID")))
    kind = options_.skill_kind(id, element.attribute("name").value_or(id));
  if (kind) {
    made.id = std::string(id);
    made.category = kind.value();
    made.kind = made.category == Category::kCondition ? Kind::kExternalCondition : Kind::kExternalAction;
    made.external = true;
    made.declared = false;
    return &made;
  }
  if (!options_.partial) {
    tell_unknown(element, id, place);
    return nullptr;
  }
  if (const Manifest* const other = find_builtin(id, 7 - model_->format)) {
    warn("bt.other-format",
         fmt::format("\"{}\" is a node of format {}, and the file is of format {}{}", id, 7 - model_->format,
                     model_->format, model_->format == 3 ? "; write BTCPP_format=\"4\"" : ""),
         place);
    return other;
  }
  made = unknown_manifest(element, id, place);
  return &made;
}

void Loader::tell_unknown(const XmlElement& element, std::string_view id, const SourceSpan& place) {
  const auto declared = declared_.find(id);
  if (definition_index_.contains(id)) {
    error("bt.unknown-node", fmt::format("\"{}\" is a BehaviorTree; write <SubTree ID=\"{}\"/>", id, id), place);
  } else if (declared != declared_.end()) {
    error("bt.unknown-node",
          fmt::format("\"{}\" is declared as {}, and no C++ node of that ID is registered", id,
                      to_string(declared->second.category)),
          place);
  } else if (options_.has_skill && options_.has_skill(id, element.attribute("name").value_or(id))) {
    error(
        "bt.undeclared-kind",
        fmt::format("is \"{}\" an action or a condition? Write <Action ID=\"{}\"/> or declare it in the TreeNodesModel",
                    id, id),
        place);
  } else {
    const std::string meant = hint(id, known_ids());
    const bool is_elsewhere = find_builtin(id, 7 - model_->format) != nullptr;
    const bool is_skill_missing = options_.skill_kind && !is_elsewhere && element.children().empty() && meant.empty();
    error("bt.unknown-node",
          fmt::format(
              "there is no node \"{}\"{}{}{}", id, meant,
              is_elsewhere ? fmt::format(" (it exists in format {}{})", 7 - model_->format,
                                         model_->format == 3 ? "; write BTCPP_format=\"4\" into <root>" : "")
                           : "",
              is_skill_missing ? fmt::format("; a skill of that name makes it a leaf, <Action ID=\"{}\"/>", id) : ""),
          place);
  }
}

std::uint32_t Loader::find_manifest(const XmlElement& element, bool& is_explicit) {
  const std::string_view tag = element.name();
  if (tag == last_tag_ && last_manifest_ != kNone) {
    is_explicit = false;
    return last_manifest_;
  }
  is_explicit = is_explicit_tag(tag);
  std::string_view id = tag;
  if (is_explicit) {
    const auto given = element.attribute("ID");
    if (!given || given->empty()) {
      error("bt.missing-id", fmt::format("<{}> needs an ID", tag), element.span());
      return kNone;
    }
    id = *given;
  }
  // An explicit tag says what an undeclared leaf is, so it has a key of its own.
  if (!is_explicit || !(tag == "Action" || tag == "Condition")) {
    if (const auto known = manifest_index_.find(id); known != manifest_index_.end()) {
      if (!is_explicit) {
        last_tag_ = known->first;
        last_manifest_ = known->second;
      }
      return known->second;
    }
  }
  Manifest made;
  const Manifest* found = known_manifest(tag, id, made);
  if (found == nullptr) found = guessed_manifest(element, id, is_explicit, made);
  if (found == nullptr) return kNone;
  if (found->external || is_explicit || found->id != id) {
    // Look for the same one again, of the same kind.
    const auto same = same_manifest_.find(std::tuple(found->id, found->kind, found->category));
    if (same != same_manifest_.end()) return same->second;
  }
  const std::uint32_t index = add_manifest(*found);
  if (found->declared && found->id == id) manifest_index_.emplace(model_->strings[string(id)], index);
  return index;
}

SourceSpan Loader::script_place(std::string_view text, const XmlElement& element, std::string_view attribute,
                                std::size_t offset) const {
  SourceSpan begin = element.attribute_value_span(attribute);
  const text::XmlDocument& xml = documents_[document_]->xml;
  // The script as written is searched for where its attribute begins.
  for (std::size_t at = element.offset(); (at = xml.source().find(text, at)) != std::string::npos; ++at) {
    const SourceSpan place = xml.span_at(at);
    if (place.line > begin.line || (place.line == begin.line && place.column > begin.column)) break;
    if (place.line == begin.line && place.column == begin.column) return xml.span_at(at + offset);
  }
  return begin;
}

std::uint32_t Loader::define_script(std::string_view text, const XmlElement& element, std::string_view attribute) {
  const std::string key(text);
  if (const auto known = script_index_.find(key); known != script_index_.end()) return known->second;
  auto script = compile_script(text, [this](std::string_view name) { return model_->enum_value(name); });
  if (!script) {
    const int column = script.error().span.column;
    report(lenient_ ? Severity::kWarning : Severity::kError, script.error().code,
           fmt::format("{}: {}", attribute, script.error().message),
           script_place(text, element, attribute, column > 0 ? static_cast<std::size_t>(column - 1) : 0));
    return kNone;
  }
  for (const ScriptWarning& warning : script->warnings) {
    warn(warning.code, fmt::format("{}: {}", attribute, warning.message),
         script_place(text, element, attribute, warning.offset));
  }
  const auto index = static_cast<std::uint32_t>(model_->scripts.size());
  model_->scripts.push_back(std::move(*script));
  script_index_.emplace(key, index);
  return index;
}

std::uint32_t Loader::entry_of(std::uint32_t text) {
  if (entry_of_.size() < model_->strings.size()) entry_of_.resize(model_->strings.size(), kUnknownText);
  if (entry_of_[text] == kUnknownText) {
    const auto name = entry_name(model_->strings[text]);
    const std::uint32_t entry = !name ? kNone : *name == "=" ? kSameName : string(*name);
    entry_of_[text] = entry;
    return entry;
  }
  return entry_of_[text];
}

void Loader::define_port(DefinedPort& port, const Manifest& manifest, const XmlElement& element, std::uint32_t name,
                         std::string_view text, const PortInfo* info) {
  port.name = name;
  if (text.size() > kPortBytesMax) {
    error("bt.too-large",
          fmt::format("port \"{}\" of {} has {} bytes; at most {} are accepted", model_->strings[name], manifest.id,
                      text.size(), kPortBytesMax),
          element.attribute_span(model_->strings[name]));
    return;
  }
  port.text = string(text);
  port.type = info != nullptr ? info->type : nullptr;
  std::uint32_t entry = entry_of(port.text);
  if (entry == kSameName || (info != nullptr && text == "=")) entry = name;
  if (entry != kNone) {
    port.kind = Binding::Kind::kEntry;
    port.target = entry;
    return;
  }
  port.kind = Binding::Kind::kLiteral;
  Datum literal{Value(text), nullptr};
  const bool reads = info != nullptr && info->direction != PortDirection::kOutput;
  if (reads && port.type != nullptr && port.type->strong() && port.type->kind != PortType::Class::kString) {
    std::string why;
    std::optional<Value> parsed = value_of_text(*model_, *port.type, text, &why);
    const bool is_count = !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
    if (!parsed && is_count && port.type->max == std::numeric_limits<std::int64_t>::max() &&
        port.type->kind == PortType::Class::kInteger) {
      why = fmt::format("whole numbers end at {}", port.type->max);
    }
    // Format 3 finds it out when the port is read.
    if (!parsed && model_->format != 3) {
      report(
          severity_of(manifest), "bt.bad-value",
          fmt::format("port \"{}\" of {}: \"{}\" is no {}{}", model_->strings[name], manifest.id, text, port.type->name,
                      !why.empty()                                  ? ": " + why
                      : port.type->parse != nullptr                 ? ""
                      : port.type->kind == PortType::Class::kObject ? "; only an entry {…} can hold one"
                                                                    : "; write json:… or an entry {…}"),
          element.attribute_value_span(model_->strings[name]));
      if (severity_of(manifest) == Severity::kError) return;
    }
    if (parsed) literal.value = std::move(*parsed);
  }
  port.target = static_cast<std::uint32_t>(model_->literals.size());
  model_->literals.push_back(std::move(literal));
}

void Loader::unknown_attribute(const XmlElement& element, const Manifest& manifest, std::string_view name) {
  std::vector<std::string> names;
  for (const PortInfo& port : manifest.ports) names.push_back(port.name);
  for (const std::string_view condition : kConditionNames) names.emplace_back(condition);
  const std::string hint = did_you_mean(name, names);
  const SourceSpan place = element.attribute_span(name);
  const std::string shown = fmt::format("\"{}\"", name);
  if (name.starts_with('_')) {
    static constexpr std::string_view kQuiet[] = {"_description", "_uid", "_fullpath", "_autoremap"};
    if (std::find(std::begin(kQuiet), std::end(kQuiet), name) != std::end(kQuiet)) return;
    warn("bt.unknown-attribute",
         fmt::format("attribute {} of {} means nothing and is kept{}", shown, manifest.id, hint), place);
  } else if (!manifest.external) {
    const Manifest* const other = find_builtin(manifest.id, 7 - model_->format);
    const auto declared = declared_.find(manifest.id);
    if (options_.partial && (was_port(manifest.id, name) || (other != nullptr && has_port(other->ports, name)) ||
                             (declared != declared_.end() && has_port(declared->second.ports, name)))) {
      warn("bt.unknown-port",
           fmt::format("{} has no port {} in format {}{}{}", manifest.id, shown, model_->format,
                       was_port(manifest.id, name) ? " any more" : "", hint),
           place);
      return;
    }
    report(lenient_ ? Severity::kWarning : Severity::kError, "bt.unknown-port",
           fmt::format("{} has no port {}{}", manifest.id, shown, hint), place);
  } else if (manifest.declared && !hint.empty()) {
    report(severity_of(manifest), "bt.unknown-port",
           fmt::format("{} has no port {} in the TreeNodesModel{}", manifest.id, shown, hint), place);
  } else if (manifest.declared) {
    warn("bt.undeclared-attribute",
         fmt::format("attribute {} of {} is declared nowhere and is kept", shown, manifest.id), place);
  }
}

void Loader::define_ports(Definition& definition, DefinedNode& node, const Manifest& manifest,
                          const std::vector<XmlAttribute>& given) {
  node.first_port = static_cast<std::uint32_t>(definition.ports.size());
  used_.assign(given.size(), false);
  const std::vector<std::uint32_t>& names = port_names_[node.manifest];
  for (std::size_t i = 0; i < manifest.ports.size(); ++i) {
    const PortInfo& info = manifest.ports[i];
    DefinedPort port;
    port.declared = static_cast<std::uint16_t>(i);
    bool found = false;
    for (std::size_t a = 0; a < given.size(); ++a) {
      if (given[a].name != info.name) continue;
      used_[a] = found = true;
      define_port(port, manifest, node.element, names[i], given[a].value, &info);
    }
    if (!found && info.default_text) {
      define_port(port, manifest, node.element, names[i], *info.default_text, &info);
      port.from_default = true;
    } else if (!found) {
      port.name = names[i];
      port.type = info.type;
    }
    definition.ports.push_back(port);
  }
  for (std::size_t a = 0; a < given.size(); ++a) {
    if (used_[a]) continue;
    unknown_attribute(node.element, manifest, given[a].name);
    if (!manifest.external || given[a].name.starts_with('_')) continue;
    DefinedPort port;
    define_port(port, manifest, node.element, string(given[a].name), given[a].value, nullptr);
    definition.ports.push_back(port);
  }
  node.port_count = static_cast<std::uint16_t>(definition.ports.size() - node.first_port);
}

void Loader::define_closed(Definition& definition, DefinedNode& node, std::string_view id) {
  Manifest closed;
  closed.id = "SubTree";
  closed.category = Category::kSubTree;
  closed.kind = Kind::kUnknown;
  closed.external = true;
  closed.declared = false;
  const auto known = std::find_if(model_->manifests.begin(), model_->manifests.end(), [](const Manifest& m) {
    return m.kind == Kind::kUnknown && m.category == Category::kSubTree;
  });
  node.manifest = known != model_->manifests.end() ? static_cast<std::uint32_t>(known - model_->manifests.begin())
                                                   : add_manifest(closed);
  node.data = string(id);
  node.first_port = static_cast<std::uint32_t>(definition.ports.size());
  for (const XmlAttribute& attribute : given_) {
    if (attribute.name.starts_with('_')) continue;
    DefinedPort port;
    define_port(port, closed, node.element, string(attribute.name), attribute.value, nullptr);
    definition.ports.push_back(port);
  }
  node.port_count = static_cast<std::uint16_t>(definition.ports.size() - node.first_port);
}

void Loader::define_subtree(Definition& definition, DefinedNode& node, const std::vector<XmlAttribute>& given) {
  const auto id = is_subtree_tag(node.element.name()) ? node.element.attribute("ID") : node.element.name();
  if (!id || id->empty()) {
    error("bt.missing-id", "<SubTree> needs an ID, the name of a BehaviorTree", node.element.span());
    return;
  }
  const SourceSpan place = node.element.attribute_value_span("ID");
  const std::uint32_t target = find_definition(*id, place);
  if (target == kNone) {
    missing("bt.unknown-tree",
            fmt::format("there is no BehaviorTree \"{}\"{}{}{}", *id, hint(*id, tree_ids()), where(*id),
                        options_.partial ? "; it is a closed box here, unless a file that has it is given too" : ""),
            place);
    if (options_.partial) define_closed(definition, node, *id);
    return;
  }
  node.data = target;
  const bool format3 = model_->format == 3;
  // Format 3's plain SubTree gives names of entries, not values; SubTreePlus is what format 4 calls SubTree.
  node.plain_names = format3 && node.element.name() != "SubTreePlus";
  node.first_port = static_cast<std::uint32_t>(definition.ports.size());
  const auto flag = [&](const XmlAttribute& attribute) {
    const auto value = detail::parse_bool(attribute.value);
    if (!value) {
      error("bt.bad-value", fmt::format("{} is \"{}\"; true or false", attribute.name, attribute.value),
            node.element.attribute_value_span(attribute.name));
    }
    return value.value_or(false);
  };
  for (const XmlAttribute& attribute : given) {
    if (attribute.name == (format3 ? "__autoremap" : "_autoremap")) {
      node.autoremap = flag(attribute);
    } else if (format3 && attribute.name == "__shared_blackboard") {
      node.shared = flag(attribute);
    } else if (attribute.name.starts_with('_')) {
      unknown_attribute(node.element, model_->manifests[node.manifest], attribute.name);
    } else {
      DefinedPort port;
      define_port(port, model_->manifests[node.manifest], node.element, string(attribute.name), attribute.value,
                  nullptr);
      if (attribute.value == "=") {
        port.kind = Binding::Kind::kEntry;
        port.target = port.name;
      }
      if (node.plain_names && port.kind == Binding::Kind::kLiteral) {
        port.kind = Binding::Kind::kEntry;
        port.target = port.text;
      }
      definition.ports.push_back(port);
    }
  }
  if (const auto model = subtree_ports_.find(*id); model != subtree_ports_.end() && !node.autoremap && !format3) {
    for (const PortInfo& info : model->second.ports) {
      const bool present =
          std::any_of(given.begin(), given.end(), [&](const XmlAttribute& a) { return a.name == info.name; });
      if (present) continue;
      if (!info.default_text || info.default_text->empty()) {
        report(lenient_ || options_.partial ? Severity::kWarning : Severity::kError, "bt.missing-port",
               fmt::format("SubTree \"{}\" needs port \"{}\": the TreeNodesModel gives no default", *id, info.name),
               node.element.span());
        continue;
      }
      DefinedPort port;
      define_port(port, model_->manifests[node.manifest], node.element, string(info.name), *info.default_text, nullptr);
      port.from_default = true;
      definition.ports.push_back(port);
    }
  }
  node.port_count = static_cast<std::uint16_t>(definition.ports.size() - node.first_port);
}

void Loader::define_attributes(Definition& definition, DefinedNode& node, bool is_explicit) {
  const Manifest& manifest = model_->manifests[node.manifest];
  std::vector<XmlAttribute>& given = given_;
  given.clear();
  node.element.for_each_attribute([&](std::string_view name, std::string_view value) {
    if (name == "name") {
      node.name_offset = static_cast<std::uint32_t>(model_->text.size());
      node.name_length = static_cast<std::uint32_t>(value.size());
      model_->text += value;
      return;
    }
    if (name == "ID" && (is_explicit || is_subtree_tag(node.element.name()) || model_->format == 3)) return;
    // Another program's attribute in a namespace of its own.
    if (name.find(':') != std::string_view::npos || name == "xmlns") return;
    const auto condition = name.starts_with('_')
                               ? std::find(std::begin(kConditionNames), std::end(kConditionNames), name)
                               : std::end(kConditionNames);
    if (condition != std::end(kConditionNames) && model_->format != 3) {
      const std::uint32_t script = define_script(value, node.element, name);
      if (node.conditions == kNone) {
        node.conditions = static_cast<std::uint32_t>(definition.conditions.size());
        definition.conditions.emplace_back();
      }
      definition.conditions[node.conditions].use[condition - std::begin(kConditionNames)] = script;
      return;
    }
    given.push_back({name, value});
  });
  if (given.size() > kPortsMax) {
    error("bt.too-large", fmt::format("more than {} attributes", kPortsMax), node.element.span());
    return;
  }
  if (manifest.kind == Kind::kSubTree) {
    define_subtree(definition, node, given);
    return;
  }
  if (!manifest.ports.empty() || !given.empty()) define_ports(definition, node, manifest, given);
  if (manifest.kind == Kind::kScript || manifest.kind == Kind::kScriptCondition ||
      manifest.kind == Kind::kPrecondition) {
    const DefinedPort& port = definition.ports[node.first_port];
    if (port.kind == Binding::Kind::kLiteral) {
      node.data =
          define_script(model_->strings[port.text], node.element, manifest.kind == Kind::kPrecondition ? "if" : "code");
    } else if (port.kind == Binding::Kind::kAbsent) {
      error("bt.missing-port",
            fmt::format("{} needs {}", manifest.id, manifest.kind == Kind::kPrecondition ? "\"if\"" : "\"code\""),
            node.element.span());
    } else if (manifest.kind == Kind::kPrecondition) {
      error("bt.bad-value", "\"if\" of Precondition must be a script, not an entry",
            node.element.attribute_value_span("if"));
    }
  }
  if (manifest.kind == Kind::kLoop) {
    const DefinedPort& port = definition.ports[node.first_port];
    if (port.kind == Binding::Kind::kLiteral && port.target != kNone) {
      node.data = static_cast<std::uint32_t>(model_->queues.size());
      const List* list = model_->literals[port.target].value.as_list();
      model_->queues.push_back(list != nullptr ? *list : List{});
    }
  }
}

void Loader::check_children(const Definition& definition, std::uint32_t index) {
  const DefinedNode& node = definition.nodes[index];
  const Manifest& manifest = model_->manifests[node.manifest];
  if (node.child_count >= manifest.children_min && node.child_count <= manifest.children_max) return;
  std::string wanted;
  if (manifest.children_max == 0) {
    wanted = manifest.category == Category::kSubTree
                 ? "a SubTree has no children here: its content is the BehaviorTree of that ID"
                 : "a leaf has no children";
  } else if (manifest.children_max == 1) {
    wanted = "a decorator has exactly one child";
  } else {
    wanted = manifest.children_min == 1 ? "a control node has at least one child"
                                        : fmt::format("it needs at least {}", manifest.children_min);
  }
  error("bt.child-count", fmt::format("{} has {} children; {}", manifest.id, node.child_count, wanted),
        node.element.span());
}

bool Loader::keeps_no_children(const Manifest& manifest, bool is_explicit) const {
  const bool leaf = manifest.category == Category::kAction || manifest.category == Category::kCondition;
  return model_->format == 3 && !is_explicit && leaf && manifest.children_max == 0;
}

bool Loader::define_node(Definition& definition, const XmlElement& element, std::uint32_t parent, std::size_t depth) {
  // The parser bounds nesting, so the recursion is bounded too.
  bool is_explicit = false;
  DefinedNode node;
  node.element = element;
  node.parent = parent;
  node.manifest = find_manifest(element, is_explicit);
  const bool known = node.manifest != kNone;
  const auto index = static_cast<std::uint32_t>(definition.nodes.size());
  if (known) {
    define_attributes(definition, node, is_explicit);
    if (parent != kNone) ++definition.nodes[parent].child_count;
    definition.nodes.push_back(node);
  }
  // It is a child all the same.
  if (!known && parent != kNone) ++definition.nodes[parent].child_count;
  // Below an unknown node the check goes on; the definition is not used then.
  bool complete = known;
  for (XmlElement child = element.first_child(); child; child = child.next_sibling()) {
    if (is_metadata(child.name())) continue;
    if (is_subtree_tag(element.name()) && child.name() == "remap" && options_.partial) {
      warn("bt.other-format", "<remap> inside a SubTree is of an older format; ports are attributes of the SubTree",
           child.span());
      continue;
    }
    if (known && keeps_no_children(model_->manifests[node.manifest], is_explicit)) {
      warn("bt.children-of-leaf",
           fmt::format(
               "{} is a leaf: what stands inside it is never ticked, as in BehaviorTree.CPP 3, which loads such a file",
               model_->manifests[node.manifest].id),
           child.span());
      break;
    }
    complete = define_node(definition, child, known ? index : kNone, depth + 1) && complete;
  }
  if (known) check_children(definition, index);
  return complete;
}

void Loader::define(Definition& definition) {
  if (definition.defined) return;
  definition.defined = true;
  document_ = definition.document;
  XmlElement first = definition.element.first_child();
  while (first && is_metadata(first.name())) first = first.next_sibling();
  if (!first) {
    error("bt.child-count", fmt::format("BehaviorTree \"{}\" is empty; it needs one node", definition.id),
          definition.element.span());
    return;
  }
  XmlElement second = first.next_sibling();
  while (second && is_metadata(second.name())) second = second.next_sibling();
  if (second) {
    error("bt.child-count",
          fmt::format("BehaviorTree \"{}\" has a second root node; put both under a control node", definition.id),
          second.span());
  }
  definition.nodes.reserve(first.size());
  if (!define_node(definition, first, kNone, 0)) definition.nodes.clear();
}

}  // namespace sentree::bt
