#include "sentree/import/detail/skill_chart.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "sentree/import/detail/snippet.h"
#include "sentree/import/detail/words.h"
#include "sentree/import/detail/xml_rewrite.h"
#include "sentree/scxml/format.h"

namespace sentree::import {

using text::XmlDocument;
using text::XmlElement;

namespace {

constexpr std::array<std::string_view, 4> kTickEvents{"CMD_START", "CMD_TICK", "TICK", "START"};
constexpr std::array<std::string_view, 4> kHaltEvents{"CMD_STOP", "CMD_HALT", "HALT", "STOP"};
constexpr std::array<std::string_view, 5> kExpressions{"cond", "expr", "eventexpr", "delayexpr", "array"};

bool is_state(const XmlElement& element) {
  const std::string_view name = element.local_name();
  return name == "state" || name == "parallel" || name == "final";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

enum class Status { kNone, kIdle, kSuccess, kFailure };

bool says_status(const XmlDocument& document) {
  bool found = false;
  for_each_element(document.root(), [&](const XmlElement& e) { found = found || attribute_named(e, "bt_status"); });
  return found;
}

bool is_service(const XmlElement& data) { return attribute_named(data, "service_type").has_value(); }

std::string plain_type(std::string_view type) {
  std::string plain;
  for (const std::string& word : words(type)) {
    if (word != "const" && word != "unsigned") plain = word;
  }
  while (plain.ends_with('&')) plain.pop_back();
  if (plain.starts_with("std::")) plain = plain.substr(5);
  return plain;
}

bool is_integer_type(std::string_view type) {
  const std::string plain = plain_type(type);
  return plain.starts_with("int") || plain.starts_with("uint") || plain == "long" || plain == "short" ||
         plain == "size_t";
}

class SkillTranslator {
 public:
  SkillTranslator(const XmlDocument& document, const SkillContext& context) : document_(document), context_(context) {
    names_.remotes = context.remotes;
    names_.enumerators = context.enumerators;
    find_states();
    for_each_element(document.root(), [&](const XmlElement& element) {
      if (element.local_name() != "data" || is_service(element)) return;
      const std::string id(element.attribute("id").value_or(""));
      names_.data.insert(id);
      if (is_integer_type(attribute_named(element, "cpp_type").value_or(""))) names_.integers.insert(id);
    });
    names_.data.insert("_event");
  }

  TranslatedChart run() {
    // Conditions may use what a snippet further down declares: the first time is for the names.
    (void)whole();
    findings_.clear();
    TranslatedChart chart{whole(), {}};
    if (auto formatted = scxml::format(chart.source, document_.file())) chart.source = std::move(*formatted);
    chart.findings = std::move(findings_);
    return chart;
  }

 private:
  [[nodiscard]] Status status_of(const XmlElement& state) const {
    std::string_view status = attribute_named(state, "bt_status").value_or("");
    if (status.empty() && !says_status_) {
      const std::string_view id = state.attribute("id").value_or("");
      if (id == "idle") return Status::kIdle;
      if (id == "success") return Status::kSuccess;
      if (id == "failure") return Status::kFailure;
    }
    if (status.ends_with("IDLE")) return Status::kIdle;
    if (status.ends_with("SUCCESS")) return Status::kSuccess;
    return status.ends_with("FAILURE") ? Status::kFailure : Status::kNone;
  }

  void find_states() {
    says_status_ = says_status(document_);
    for_each_element(document_.root(), [&](const XmlElement& element) {
      if (!is_state(element)) return;
      const std::string id(element.attribute("id").value_or(""));
      const Status status = status_of(element);
      const std::vector<XmlElement> children = element.children();
      const bool atomic = std::none_of(children.begin(), children.end(), is_state);
      if (status == Status::kSuccess && atomic && !success_) success_ = element;
      if (status == Status::kFailure && atomic && !failure_) failure_ = element;
      if (id == "success" || id == "failure" || id == "halted")
        renamed_[id] = id == "halted" ? "halting" : id + "_state";
      if (status == Status::kIdle && idle_.empty()) idle_ = id;
    });
    if (success_) renamed_[std::string(success_.attribute("id").value_or(""))] = "success";
    if (failure_) renamed_[std::string(failure_.attribute("id").value_or(""))] = "failure";
  }

  [[nodiscard]] std::string renamed(const std::string& id) const {
    const auto name = renamed_.find(id);
    return name == renamed_.end() ? id : name->second;
  }

  [[nodiscard]] std::string renamed_list(std::string_view ids) const {
    std::vector<std::string> names = words(ids);
    for (std::string& name : names) name = renamed(name);
    return joined(names);
  }

  std::string whole() {
    needs_halted_ = false;
    needs_failure_ = false;
    new_data_.clear();
    const XmlElement root = document_.root();
    std::string inside = rewritten_inside(document_, root, [&](const XmlElement& child) { return outside(child); });
    std::string declared;
    for (const std::string& name : new_data_) declared += fmt::format("<data{}/>\n", text::xml_attribute("id", name));
    if (!declared.empty() && !has_datamodel_)
      inside = fmt::format("\n<datamodel>\n{}</datamodel>\n{}", declared, inside);
    if (has_datamodel_) {
      const std::size_t end = inside.find("</datamodel>");
      if (end != std::string::npos) inside.insert(end, declared);
    }
    for (const XmlElement& end : {success_, failure_}) {
      if (end && end.parent() != root) inside += final_of(end) + "\n";
    }
    if (!success_ && !failure_) {
      findings_.push_back(
          {Fate::kByHand, root.span(), "",
           "no state tells SUCCESS or FAILURE, so the skill never ends; add <final id=\"success\"/> and "
           "<final id=\"failure\"/>"});
    }
    if (needs_failure_) inside += "<final id=\"failure\"/>\n";
    if (needs_halted_) inside += "<final id=\"halted\"/>\n";
    std::map<std::string, std::optional<std::string>> changes{{"datamodel", "ecmascript"}};
    if (const auto initial = root.attribute("initial")) changes["initial"] = renamed_list(*initial);
    const std::string_view source = document_.source();
    return fmt::format("{}{}\n", source.substr(0, root.offset()), element_text(root, start_tag(root, changes), inside));
  }

  /// Elements that are no executable content.
  std::string outside(const XmlElement& element) {
    const std::string_view name = element.local_name();
    if (name == "datamodel") return datamodel(element);
    if (name == "transition") return transition(element);
    if (name == "onentry" || name == "onexit") return block(element);
    if (name == "script") return by_hand(element, "a script of the whole chart; put it into the <onentry> of a state");
    if (is_state(element)) return state(element);
    std::map<std::string, std::optional<std::string>> changes;
    if (const auto initial = element.attribute("initial")) changes["initial"] = renamed_list(*initial);
    return element_text(element, start_tag(element, changes),
                        rewritten_inside(document_, element, [&](const XmlElement& child) { return outside(child); }));
  }

  std::string by_hand(const XmlElement& element, std::string reason) {
    const std::string original(source_of(document_, element));
    findings_.push_back({Fate::kByHand, element.span(), shortened(original), std::move(reason)});
    return comment_of("not translated, see IMPORT.md: " + original);
  }

  std::string datamodel(const XmlElement& element) {
    has_datamodel_ = true;
    return fmt::format("{}>{}</datamodel>", start_tag(element),
                       rewritten_inside(document_, element, [&](const XmlElement& child) { return data(child); }));
  }

  std::string data(const XmlElement& element) {
    if (element.local_name() != "data") return std::string(source_of(document_, element));
    const std::string id(element.attribute("id").value_or(""));
    if (is_service(element)) {
      return comment_of(fmt::format("{} is the service {} of sentree.yaml", id, context_.remotes.at(id).service));
    }
    const std::string type = plain_type(attribute_named(element, "cpp_type").value_or(""));
    const std::string_view written = element.attribute("expr").value_or("");
    if (written.empty()) return element_text(element, start_tag(element), std::string(element.inner_source()));
    const auto value = initial_value(written, type);
    if (!value) {
      findings_.push_back({Fate::kByHand, element.span(), shortened(source_of(document_, element)),
                           "its first value has no counterpart: " + value.error().message});
      return start_tag(element, {{"expr", std::nullopt}}) + "/>";
    }
    return start_tag(element, {{"expr", *value}}) + "/>";
  }

  [[nodiscard]] Result<std::string> initial_value(std::string_view written, const std::string& type) const {
    if (type == "string" || type == "QString") {
      const bool has_quotes = written.size() > 1 && (written.front() == '"' || written.front() == '\'');
      return script_text(has_quotes ? written.substr(1, written.size() - 2) : written);
    }
    if (const auto structure = context_.structures.find(type); structure != context_.structures.end()) {
      const std::vector<Token> tokens = tokens_of(written);
      const std::vector<Tokens> values = split(Tokens(tokens), ",");
      std::string object;
      for (std::size_t i = 0; i < values.size() && i < structure->second->fields.size(); ++i) {
        const auto value = translate_expression(values[i], names_);
        if (!value) return tl::unexpected(value.error());
        object += fmt::format("{}{}: {}", object.empty() ? "" : ", ", structure->second->fields[i].name, value->text);
      }
      return fmt::format("{{{}}}", object);
    }
    auto value = translate_expression(written, names_);
    if (!value) return tl::unexpected(value.error());
    return std::move(value->text);
  }

  std::string transition(const XmlElement& element) {
    std::vector<std::string> events = words(element.attribute("event").value_or(""));
    bool by_tick = false;
    for (std::string& event : events) {
      if (contains(kTickEvents, event)) {
        event = "tick";
        by_tick = true;
      } else if (contains(kHaltEvents, event)) {
        event = "halt";
      }
    }
    std::map<std::string, std::optional<std::string>> changes;
    if (!events.empty()) changes["event"] = joined(events);
    if (const auto target = element.attribute("target")) {
      std::vector<std::string> targets = words(*target);
      for (std::string& name : targets) {
        // Back to idle: what the tree asked for is over, and it was no success and no failure.
        const bool ends = name == idle_ && !by_tick;
        needs_halted_ = needs_halted_ || ends;
        name = ends ? "halted" : renamed(name);
      }
      changes["target"] = joined(targets);
    }
    if (const auto condition = element.attribute("cond")) {
      const auto translated = expression(*condition, element);
      if (!translated) return by_hand(element, "its condition: " + translated.error().message);
      changes["cond"] = *translated;
    }
    return element_text(element, start_tag(element, changes), content(element));
  }

  Result<std::string> expression(std::string_view source, const XmlElement& element) {
    auto translated = translate_expression(source, names_);
    if (!translated) return tl::unexpected(translated.error());
    if (translated->divides_integers) {
      findings_.push_back({Fate::kReview, element.span(), shortened(source),
                           "C++ divides integers without rest, ECMAScript does not; Math.floor(…) where that matters"});
    }
    for (const auto& [id, name] : renamed_) {
      const std::string asked = fmt::format("In('{}')", id);
      for (std::size_t at = translated->text.find(asked); at != std::string::npos;
           at = translated->text.find(asked, at + 1))
        translated->text.replace(at, asked.size(), fmt::format("In('{}')", name));
    }
    return std::move(translated->text);
  }

  /// Executable content in which no reply can be waited for.
  std::string content(const XmlElement& parent) {
    return rewritten_inside(document_, parent, [&](const XmlElement& child) { return executable(child); });
  }

  std::string block(const XmlElement& element) { return element_text(element, start_tag(element), content(element)); }

  std::string executable(const XmlElement& element) {
    const std::string_view name = element.local_name();
    if (name == "script") {
      const Names before = names_;
      Snippet snippet = translate_snippet(element.text(), script_place(element), names_);
      if (snippet.pieces.size() > 1) {
        names_ = before;
        return by_hand(
            element,
            "a call whose result is used can be waited for only on entry of a state without states in it; draw "
            "one that makes the call");
      }
      take(snippet);
      return snippet.pieces.front().xml;
    }
    std::map<std::string, std::optional<std::string>> changes;
    std::optional<std::string> problem;
    element.for_each_attribute([&](std::string_view attribute, std::string_view value) {
      const bool is_location = attribute == "location" || attribute == "item" || attribute == "index";
      if (problem || (!contains(kExpressions, attribute) && !is_location)) return;
      const auto translated = expression(value, element);
      if (!translated) {
        problem = translated.error().message;
      } else {
        changes[std::string(attribute)] = *translated;
      }
    });
    if (problem) {
      // The branch of an <if> cannot be a comment alone.
      if (name == "elseif") return by_hand(element, *problem) + "<elseif cond=\"false\"/>";
      return by_hand(element, *problem);
    }
    if (name == "send" || name == "raise" || name == "log" || name == "cancel") {
      return element_text(element, start_tag(element, changes), content(element));
    }
    return element_text(element, start_tag(element, changes), content(element));
  }

  void take(Snippet& snippet) {
    for (std::string& name : snippet.new_data) {
      if (!contains(new_data_, name)) new_data_.push_back(name);
    }
    // The second time around, names of the first are known already.
    for (const std::string& name : names_.data) {
      if (declared_.contains(name) && !contains(new_data_, name)) new_data_.push_back(name);
    }
    declared_.insert(new_data_.begin(), new_data_.end());
    findings_.insert(findings_.end(), snippet.findings.begin(), snippet.findings.end());
  }

  [[nodiscard]] SourceSpan script_place(const XmlElement& script) const {
    const std::string_view inner = script.inner_source();
    if (inner.empty()) return script.span();
    return document_.span_at(static_cast<std::size_t>(inner.data() - document_.source().data()));
  }

  std::string final_of(const XmlElement& state) {
    const bool is_success = state == success_;
    std::string inside;
    for (const XmlElement& child : state.children()) {
      const std::string_view name = child.local_name();
      if (name == "onentry" || name == "onexit") {
        inside += block(child) + "\n";
      } else if (name == "transition") {
        findings_.push_back({Fate::kNotNeeded, child.span(), shortened(source_of(document_, child)),
                             "the run of a skill ends with its answer; the next one begins anew"});
      } else {
        inside += fmt::format("{}\n", source_of(document_, child));
      }
    }
    std::string tag = "<final" + text::xml_attribute("id", is_success ? "success" : "failure");
    return tag + (inside.empty() ? "/>" : fmt::format(">\n{}</final>", inside));
  }

  std::string state(const XmlElement& element) {
    const Status status = status_of(element);
    if (element == success_ || element == failure_)
      return element.parent() == document_.root() ? final_of(element) : "";
    std::map<std::string, std::optional<std::string>> changes;
    const std::string id(element.attribute("id").value_or(""));
    if (!id.empty()) changes["id"] = renamed(id);
    if (const auto initial = element.attribute("initial")) changes["initial"] = renamed_list(*initial);
    if (status == Status::kSuccess || status == Status::kFailure) {
      // Another state with the same answer.
      std::string inside = rewritten_inside(document_, element, [&](const XmlElement& child) {
        return child.local_name() == "transition" ? std::string() : outside(child);
      });
      inside += fmt::format("<transition{}/>",
                            text::xml_attribute("target", status == Status::kSuccess ? "success" : "failure"));
      return element_text(element, start_tag(element, changes), inside);
    }
    if (auto waiting = waiting_state(element, changes)) return std::move(*waiting);
    return element_text(element, start_tag(element, changes),
                        rewritten_inside(document_, element, [&](const XmlElement& child) { return outside(child); }));
  }

  /// A state whose entry makes calls and uses their results, as states that wait for one reply after the other.
  std::optional<std::string> waiting_state(const XmlElement& element,
                                           std::map<std::string, std::optional<std::string>> changes) {
    const std::vector<XmlElement> children = element.children();
    if (element.local_name() != "state" || std::any_of(children.begin(), children.end(), is_state)) return std::nullopt;
    const Names before = names_;
    const std::size_t findings = findings_.size();
    std::vector<Piece> pieces(1);
    for (const XmlElement& entry : children) {
      if (entry.local_name() != "onentry") continue;
      // Comments between the elements stay with what they stand beside.
      pieces.back().xml += rewritten_inside(document_, entry, [&](const XmlElement& child) -> std::string {
        if (child.local_name() != "script") return executable(child);
        Snippet snippet = translate_snippet(child.text(), script_place(child), names_);
        take(snippet);
        return join(pieces, std::move(snippet.pieces));
      });
      settle(pieces);
    }
    if (pieces.size() < 2) {
      names_ = before;
      findings_.resize(findings);
      return std::nullopt;
    }
    const std::string id = renamed(std::string(element.attribute("id").value_or("state")));
    return waiting_text(element, id, pieces, std::move(changes));
  }

  // `rewritten_inside` concatenates; a mark stands where a call must be waited for.
  static constexpr std::string_view kMark = "\x01";

  std::string join(std::vector<Piece>&, std::vector<Piece> more) {
    std::string text;
    for (Piece& piece : more) {
      text += piece.xml;
      if (!piece.call) continue;
      text += kMark;
      marked_.push_back({{}, std::move(piece.call), std::move(piece.result)});
    }
    return text;
  }

  void settle(std::vector<Piece>& pieces) {
    std::string text = std::move(pieces.back().xml);
    pieces.pop_back();
    for (Piece& call : marked_) {
      const std::size_t mark = text.find(kMark);
      call.xml = text.substr(0, mark);
      text = text.substr(mark + 1);
      pieces.push_back(std::move(call));
    }
    marked_.clear();
    pieces.push_back({std::move(text), std::nullopt, {}});
  }

  std::string waiting_text(const XmlElement& element, const std::string& id, const std::vector<Piece>& pieces,
                           std::map<std::string, std::optional<std::string>> changes) {
    const std::string done = id + ".done";
    std::vector<std::string> steps;
    for (std::size_t i = 0; i + 1 < pieces.size(); ++i) {
      std::string step = fmt::format("{}.{}", id, pieces[i].call->method);
      if (contains(steps, step)) step += fmt::format(".{}", i + 1);
      steps.push_back(std::move(step));
    }
    steps.push_back(done);
    std::string inside = "\n";
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      std::string entry = pieces[i].xml;
      if (pieces[i].call) entry += send_of(*pieces[i].call, steps[i]) + "\n";
      inside += fmt::format("<state{}>\n", text::xml_attribute("id", steps[i]));
      if (entry.find('<') != std::string::npos) inside += fmt::format("<onentry>\n{}</onentry>\n", entry);
      if (pieces[i].call) inside += outcomes(*pieces[i].call, pieces[i].result, steps[i], steps[i + 1]);
      for (const XmlElement& child : element.children()) {
        const bool eventless =
            child.local_name() == "transition" && words(child.attribute("event").value_or("")).empty();
        if (i + 1 == pieces.size() && eventless) inside += transition(child) + "\n";
      }
      inside += "</state>\n";
    }
    const std::string rest = rewritten_inside(document_, element, [&](const XmlElement& child) {
      const bool eventless = child.local_name() == "transition" && words(child.attribute("event").value_or("")).empty();
      return child.local_name() == "onentry" || eventless ? std::string() : outside(child);
    });
    changes["initial"] = steps.front();
    return element_text(element, start_tag(element, changes), inside + rest);
  }

  std::string outcomes(const RemoteCall& call, const std::string& result, const std::string& id,
                       const std::string& next) {
    const std::string name = fmt::format("{}.{}", call.service, call.method);
    const std::string mine = fmt::format("_event.sendid === '{}'", id);
    std::string text = fmt::format("<transition{}{}{}", text::xml_attribute("event", name + ".reply"),
                                   text::xml_attribute("cond", mine), text::xml_attribute("target", next));
    if (result.empty()) {
      text += "/>\n";
    } else {
      text += fmt::format(">\n<assign{} expr=\"_event.data.result\"/>\n</transition>\n",
                          text::xml_attribute("location", result));
    }
    // What the original's generated client does with no answer is to go on with a default value; here the call's
    // failure is the skill's.
    needs_failure_ = needs_failure_ || !failure_;
    text += fmt::format("<transition{}{} target=\"failure\"/>\n",
                        text::xml_attribute("event", fmt::format("error {}.error", name)),
                        text::xml_attribute("cond", mine));
    return text;
  }

  const XmlDocument& document_;
  const SkillContext& context_;
  Names names_;
  std::vector<Finding> findings_;
  std::vector<std::string> new_data_;
  std::set<std::string> declared_;
  std::vector<Piece> marked_;
  std::map<std::string, std::string> renamed_;
  std::string idle_;
  XmlElement success_;
  XmlElement failure_;
  bool says_status_ = false;
  bool has_datamodel_ = false;
  bool needs_halted_ = false;
  bool needs_failure_ = false;
};

}  // namespace

bool is_skill_chart(const XmlDocument& document) {
  bool found = document.root().attribute("datamodel").value_or("").starts_with("cplusplus");
  for_each_element(document.root(), [&](const XmlElement& element) {
    if (attribute_named(element, "bt_status")) found = true;
    if (element.local_name() != "transition") return;
    for (const std::string& event : words(element.attribute("event").value_or(""))) {
      if (contains(kTickEvents, event) || contains(kHaltEvents, event)) found = true;
    }
  });
  return found;
}

SkillFacts facts_of(const XmlDocument& document) {
  SkillFacts facts;
  facts.name = document.root().attribute("name").value_or("");
  for (const std::string_view ending : {"StateMachine", "Skill"}) {
    if (facts.name.size() > ending.size() && facts.name.ends_with(ending))
      facts.name.erase(facts.name.size() - ending.size());
  }
  for_each_element(document.root(), [&](const XmlElement& element) {
    if (element.local_name() == "transition") {
      for (const std::string& event : words(element.attribute("event").value_or("")))
        facts.handles_halt = facts.handles_halt || contains(kHaltEvents, event);
    }
    if (element.local_name() != "data") return;
    const std::string id(element.attribute("id").value_or(""));
    if (is_service(element)) {
      std::string_view server = attribute_named(element, "port_name_server").value_or("");
      while (server.starts_with('/')) server.remove_prefix(1);
      const bool observed =
          attribute_named(element, "connect_type").value_or("").find("portmonitor") != std::string_view::npos;
      facts.services.push_back(
          {id, std::string(*attribute_named(element, "service_type")), std::string(server), observed, element.span()});
    } else if (attribute_named(element, "init_source") == "parse_as_option") {
      const std::string type = plain_type(attribute_named(element, "cpp_type").value_or(""));
      facts.options.push_back({id, type == "string" || type == "QString", element.span()});
    }
  });
  return facts;
}

TranslatedChart translate_skill_chart(const XmlDocument& document, const SkillContext& context) {
  return SkillTranslator(document, context).run();
}

}  // namespace sentree::import
