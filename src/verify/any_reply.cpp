#include "sentree/verify/any_reply.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "sentree/project/any_reply.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"
#include "sentree/text/yaml_node_edit.h"
#include "sentree/verify/detail/distinctions.h"
#include "sentree/verify/detail/reply_flow.h"

namespace sentree::verify {

namespace {

// As a text of ECMAScript between apostrophes.
std::string script_text(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    if (c == '\n')
      out += "\\n";
    else
      out += c;
  }
  return out + "'";
}

// Writes replies of one service.
class Writer {
 public:
  Writer(const std::string& service, const Distinctions& uses, AnyReply& out)
      : service_(service), uses_(uses), out_(out) {}

  std::optional<Diagnostic> operator()(const std::vector<const idl::Method*>& methods) {
    std::string transitions;
    for (const idl::Method* method : methods) transitions += transition(*method);
    out_.chart = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!--\n  Answers every call of \"{}\" with any reply of its type, "
        "at once. Varied is what the mission looks at:\n",
        service_);
    for (const std::string& line : out_.tried) out_.chart += fmt::format("    {}\n", comment(line));
    if (out_.unsure) out_.chart += fmt::format("  That is not all: {}\n", comment(to_string(*out_.unsure)));
    for (const Untried& one : out_.untried)
      out_.chart += fmt::format("  That is not all: {}\n", comment(to_string(one.told)));
    out_.chart += fmt::format(
        "  In a folder verify/any it is written anew each time. In models/, where the option model of sentree verify "
        "puts one to "
        "keep,\n  leave out what the component never answers, and let it remember what it must.\n-->\n<scxml "
        "xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" datamodel=\"ecmascript\" name=\"any_{}\" "
        "initial=\"any\">\n  <state id=\"any\">\n{}  </state>\n</scxml>\n",
        service_, transitions);
    return trouble_;
  }

 private:
  static std::string comment(std::string text) {
    for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--")) text.replace(at, 2, "- -");
    return text;
  }

  std::string transition(const idl::Method& method) {
    const std::string head = fmt::format("    <transition event=\"{}.{}.request\">\n", service_, method.name);
    std::string reply = fmt::format("<send type=\"thrift\" target=\"{}\" event=\"{}.reply\"", service_, method.name);
    if (method.result->kind == idl::Kind::kVoid)
      reply += "/>";
    else
      reply += fmt::format("><param name=\"result\" expr=\"{}\"/></send>",
                           text::xml_escape(value(*method.result, "result", method.name, 0, nullptr)));
    if (method.exceptions.empty()) return fmt::format("{}      {}\n    </transition>\n", head, reply);
    return fmt::format(
        "{}      <if cond=\"pick('{}', 'replies', 'throws') === 'replies'\">\n        {}\n      <else/>\n        <send "
        "type=\"thrift\" target=\"{}\" event=\"{}.error\"><param name=\"kind\" expr=\"'exception'\"/></send>\n      "
        "</if>\n    </transition>\n",
        head, method.name, reply, service_, method.name);
  }

  std::string picked(const std::string& path, const std::vector<std::string>& values) {
    if (values.size() == 1) return values.front();
    if (values.size() > kReplyValuesMax && !trouble_) {
      trouble_ = Diagnostic{Severity::kError,
                            "verify.any-reply",
                            fmt::format("{}.{} is compared with so many constants that {} values would have to be "
                                        "tried, at most {}; write a model of the service",
                                        service_, path, values.size(), kReplyValuesMax),
                            {}};
    }
    std::string line = path + ": ";
    std::string call = "pick(" + script_text(path);
    for (const std::string& value : values) {
      call += ", " + value;
      line += (line.back() == ' ' ? "" : ", ") + value;
    }
    out_.tried.push_back(std::move(line));
    return call + ")";
  }

  // @param name   Under which expressions read it.
  // @param field  Nothing for a result and for elements.
  std::string value(const idl::Type& type, const std::string& name, const std::string& path, int depth,
                    const idl::Field* field) {
    const bool named = name == "result" || uses_.mentions(name);
    switch (type.kind) {
      case idl::Kind::kVoid: return "null";
      case idl::Kind::kBool: return named ? picked(path, {"false", "true"}) : "false";
      case idl::Kind::kI8:
      case idl::Kind::kI16:
      case idl::Kind::kI32:
      case idl::Kind::kI64:
      case idl::Kind::kDouble:
        return named ? picked(path, numbers(type, name, path, field)) : plain_decimal(zero(field));
      case idl::Kind::kString: return named ? picked(path, texts(name, path)) : "''";
      case idl::Kind::kBinary: return "''";
      case idl::Kind::kEnum: {
        // What nothing names is told apart by nothing: one stands for all, or as many as are compared with each other.
        std::vector<std::string> values;
        std::vector<std::string> others;
        const std::size_t count = uses_.ordered.contains(name) ? SIZE_MAX : at_once(name);
        for (const idl::Enumerator& one : type.enumeration->enumerators) {
          if (named && uses_.writes(one.name))
            values.push_back(script_text(one.name));
          else if (others.size() < count)
            others.push_back(script_text(one.name));
        }
        values.insert(values.end(), others.begin(), others.end());
        return values.empty() ? "0" : picked(path, values);
      }
      case idl::Kind::kStruct: return record(*type.structure, path, depth);
      case idl::Kind::kList:
      case idl::Kind::kSet: return "[]";
      case idl::Kind::kMap: return "{}";
    }
    return "null";
  }

  std::string record(const idl::Struct& type, const std::string& path, int depth) {
    std::string out = "({";
    if (depth >= kReplyNestingMax || ++records_ > kReplyRecordsMax) {
      if (records_ > kReplyRecordsMax && !trouble_) {
        trouble_ = Diagnostic{Severity::kError,
                              "verify.any-reply",
                              fmt::format("a reply {}.{} holds more than {} records; write a model of the service",
                                          service_, path.substr(0, path.find('.')), kReplyRecordsMax),
                              {}};
      }
      return out + "})";
    }
    if (type.kind == idl::StructKind::kUnion) return one_of(type, path, depth);
    for (const idl::Field& field : type.fields) {
      const bool is_recursive = depth > 0 && !field.when_absent && field.type->kind == idl::Kind::kStruct;
      if (field.requiredness == idl::Requiredness::kOptional && (is_recursive || !mentioned(field, depth))) continue;
      const std::string inner = fmt::format("{}.{}", path, field.name);
      std::string made = value(*field.type, field.name, inner, depth + 1, &field);
      const bool may_be_absent = field.requiredness == idl::Requiredness::kOptional && !field.when_absent;
      if (may_be_absent && is_told_apart(field))
        made = fmt::format("{} ? {} : undefined", picked(inner + " is there", {"true", "false"}), made);
      out += fmt::format("{}{}: {}", out.size() == 2 ? "" : ", ", field.name, made);
    }
    return out + "})";
  }

  // Whether it makes a difference that it is not there: what is compared is then neither less nor more.
  bool is_told_apart(const idl::Field& field) const {
    const bool is_handed = field.type->kind == idl::Kind::kString || field.type->kind == idl::Kind::kDouble ||
                           field.type->kind == idl::Kind::kI8 || field.type->kind == idl::Kind::kI16 ||
                           field.type->kind == idl::Kind::kI32 || field.type->kind == idl::Kind::kI64;
    return !is_handed || uses_.absent.contains(field.name) || uses_.numbers.contains(field.name) ||
           uses_.texts.contains(field.name) || uses_.at_once.contains(field.name);
  }

  // Of a union: exactly one member, each that somebody names, or one that nobody does.
  std::string one_of(const idl::Struct& type, const std::string& path, int depth) {
    std::vector<const idl::Field*> members;
    const idl::Field* other = nullptr;
    for (const idl::Field& field : type.fields) {
      // One that holds itself ends at the second level.
      if (depth > 1 && field.type->kind == idl::Kind::kStruct) continue;
      if (mentioned(field, depth))
        members.push_back(&field);
      else if (other == nullptr)
        other = &field;
    }
    if (other != nullptr) members.push_back(other);
    std::string out = "({})";
    for (auto member = members.rbegin(); member != members.rend(); ++member) {
      const std::string inner = fmt::format("{}.{}", path, (*member)->name);
      const std::string made = fmt::format("({{{}: {}}})", (*member)->name,
                                           value(*(*member)->type, (*member)->name, inner, depth + 1, *member));
      out = member == members.rbegin()
                ? made
                : fmt::format("({} ? {} : {})", picked(inner + " is set", {"true", "false"}), made, out);
    }
    return out;
  }

  bool mentioned(const idl::Field& field, int depth) {
    if (uses_.mentions(field.name)) return true;
    if (field.type->kind != idl::Kind::kStruct || depth >= kReplyNestingMax) return false;
    const std::pair key(field.type->structure, depth);
    if (const auto known = mentioned_.find(key); known != mentioned_.end()) return known->second;
    const auto& fields = field.type->structure->fields;
    const bool found =
        std::any_of(fields.begin(), fields.end(), [&](const idl::Field& inner) { return mentioned(inner, depth + 1); });
    mentioned_[key] = found;
    return found;
  }

  static double zero(const idl::Field* field) {
    const double low = field != nullptr && field->min ? *field->min : 0;
    const double high = field != nullptr && field->max ? *field->max : 0;
    return low > 0 ? low : high < 0 ? high : 0;
  }

  // What a type holds.
  static std::pair<double, double> range(idl::Kind kind) {
    switch (kind) {
      case idl::Kind::kI8: return {-128, 127};
      case idl::Kind::kI16: return {-32'768, 32'767};
      case idl::Kind::kI32: return {-2'147'483'648.0, 2'147'483'647.0};
      // The greatest below 2^63 that a script knows.
      case idl::Kind::kI64: return {-9'223'372'036'854'775'808.0, 9'223'372'036'854'774'784.0};
      default: return {-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};
    }
  }

  // The next whole numbers that a script knows.
  static double below(double number) {
    const double next = std::ceil(number) - 1;
    return next < number ? next : std::nextafter(number, -std::numeric_limits<double>::infinity());
  }
  static double above(double number) { return 0.0 - below(-number); }

  // A step further, also where steps are too small to tell, or the next one would have no end.
  static double beyond(double number, double step) {
    constexpr double kMost = std::numeric_limits<double>::max();
    return std::min(kMost, std::max(number + step, std::nextafter(number, kMost)));
  }

  // How many values must stand between two constants so that they and earlier ones come in every order.
  std::size_t at_once(const std::string& name) const {
    const auto found = uses_.at_once.find(name);
    // One more than may be tried is refused.
    return found == uses_.at_once.end() ? 1 : std::min(found->second, kReplyValuesMax + 1);
  }

  // At least `count` numbers between two, if so many are.
  static std::vector<double> between(double low, double high, std::size_t count, bool is_whole) {
    std::vector<double> all;
    if (is_whole) {
      all.push_back(std::floor((low + high) / 2));
      for (double next = above(low); next < high && all.size() <= count; next = above(next)) all.push_back(next);
      return all;
    }
    for (std::size_t i = 1; i <= count; ++i) {
      const double part = static_cast<double>(i) / static_cast<double>(count + 1);
      double number = std::isfinite(high - low) ? low + (high - low) * part : low * (1 - part) + high * part;
      // A short one is easier to read.
      const double rounded = std::round(number * 1e6) / 1e6;
      if (rounded > low && rounded < high && (all.empty() || rounded > all.back())) number = rounded;
      all.push_back(number);
    }
    return all;
  }

  // Of a value that is ordered against earlier ones not all are tried.
  void leave_untried(const std::string& name, const std::string& path) {
    for (const Distinctions::Ordered& ordered : uses_.ordered.at(name)) {
      const std::string value = fmt::format("{}.{}", service_, path);
      out_.untried.push_back(
          {value,
           {Severity::kWarning, "verify.not-all",
            fmt::format("{} is ordered against earlier replies, of which each may be greater than the one before: of "
                        "rows that are longer than the values that are tried nothing is known. Let the interface bound "
                        "it to at most {} whole numbers (min, max), or write a model of the service; sentree verify "
                        "--model writes one to begin with",
                        value, kReplyValuesMax),
            ordered.place},
           ordered.monitor});
    }
  }

  std::vector<std::string> numbers(const idl::Type& type, const std::string& name, const std::string& path,
                                   const idl::Field* field) {
    const std::size_t count = at_once(name);
    const auto found = uses_.numbers.find(name);
    if (found == uses_.numbers.end() && count == 1) return {plain_decimal(zero(field))};
    std::set<double> constants = found == uses_.numbers.end() ? std::set<double>{zero(field)} : found->second;
    const bool is_whole = type.kind != idl::Kind::kDouble;
    const double step =
        is_whole || constants.size() < 2 ? 1 : std::max(1e-9, (*constants.rbegin() - *constants.begin()) / 2);
    const std::pair<double, double> bounds = range(type.kind);
    const double low = field != nullptr && field->min ? std::max(*field->min, bounds.first) : bounds.first;
    const double high = field != nullptr && field->max ? std::min(*field->max, bounds.second) : bounds.second;
    std::set<double> values;
    const auto add = [&](double number) {
      if (number >= low && number <= high && (!is_whole || number == std::floor(number))) values.insert(number);
    };
    if (field != nullptr && field->min) add(low);
    if (field != nullptr && field->max) add(high);
    if (uses_.ordered.contains(name)) {
      const bool is_small = is_whole && high - low < static_cast<double>(kReplyValuesMax);
      if (is_small) {
        for (double number = std::ceil(low); number <= high; ++number) add(number);
      } else {
        leave_untried(name, path);
      }
    }
    // Beyond the outermost there may be room for less than a step.
    if (count > 1) {
      if (*constants.begin() - low < step * static_cast<double>(count)) constants.insert(low);
      if (high - *constants.rbegin() < step * static_cast<double>(count)) constants.insert(high);
    }
    double outside_low = *constants.begin();
    double outside_high = *constants.rbegin();
    for (std::size_t i = 0; i < count; ++i) {
      add(outside_low = is_whole ? below(outside_low) : 0.0 - beyond(0.0 - outside_low, step));
      add(outside_high = is_whole ? above(outside_high) : beyond(outside_high, step));
    }
    for (auto at = constants.begin(); at != constants.end(); ++at) {
      add(*at);
      if (std::next(at) == constants.end()) break;
      for (const double number : between(*at, *std::next(at), count, is_whole)) add(number);
    }
    std::vector<std::string> out;
    for (const double number : values) out.push_back(plain_decimal(number));
    // What is no number is neither less nor more than any; bounds say that there is one.
    if (!is_whole && (field == nullptr || (!field->min && !field->max))) out.emplace_back("NaN");
    if (out.empty()) out.push_back(plain_decimal(zero(field)));
    return out;
  }

  std::vector<std::string> texts(const std::string& name, const std::string& path) {
    if (uses_.ordered.contains(name)) leave_untried(name, path);
    std::vector<std::string> out;
    const auto found = uses_.texts.find(name);
    const bool is_compared = found != uses_.texts.end();
    if (is_compared) {
      for (const std::string& text : found->second) out.push_back(script_text(text));
    } else {
      out.emplace_back("''");
    }
    std::string other = "other";
    for (std::size_t i = is_compared ? 0 : 1; i < at_once(name); ++i, other += "_") {
      while (is_compared && found->second.contains(other)) other += "_";
      out.push_back(script_text(other));
    }
    return out;
  }

  const std::string& service_;
  const Distinctions& uses_;
  AnyReply& out_;
  std::map<std::pair<const idl::Struct*, int>, bool> mentioned_;  // a struct as deep: whether a member of it is
  std::size_t records_ = 0;
  std::optional<Diagnostic> trouble_;
};

// What the service publishes and somebody waits for: when that comes and what it says is known to nobody.
std::optional<Diagnostic> unknown_topic(const project::Plan& plan, const std::string& service) {
  const auto looks = [&](const std::string& who, const std::vector<std::string>& topics) -> std::optional<Diagnostic> {
    for (const std::string& topic : topics) {
      if (!topic.starts_with(service + ".")) continue;
      const auto& entries = plan.scenario.project.services;
      const auto entry =
          std::find_if(entries.begin(), entries.end(), [&](const auto& one) { return one.name == service; });
      return Diagnostic{
          Severity::kError, "verify.any-reply",
          fmt::format("{} waits for {}, and when that is published and what it says is not known: a model says it by "
                      "<send type=\"thrift\" target=\"{}\" event=\"{}\"/>",
                      who, topic, service, topic.substr(service.size() + 1)),
          entry != entries.end() ? entry->span : SourceSpan()};
    }
    return std::nullopt;
  };
  for (const project::LeafPlan& leaf : plan.leaves) {
    if (auto unknown = looks(leaf.name, leaf.subscribes)) return unknown;
  }
  for (const project::ModelPlan& model : plan.models) {
    if (auto unknown = looks(model.name, model.subscribes)) return unknown;
  }
  return std::nullopt;
}

Result<AnyReply> any_reply(const project::Plan& plan, const MissionDistinctions& mission, const std::string& service) {
  std::vector<const idl::Method*> methods;
  const Distinctions uses = mission.of(service, &methods);
  AnyReply out;
  out.unsure = uses.trouble ? uses.trouble : unknown_topic(plan, service);
  if (const auto trouble = Writer(service, uses, out)(methods)) return tl::unexpected(*trouble);
  return out;
}

}  // namespace

Result<AnyReply> any_reply(const project::Plan& plan, const std::string& service) {
  return any_reply(plan, MissionDistinctions(plan), service);
}

std::vector<Untried> untried(const std::vector<MadeModel>& made) {
  std::vector<Untried> all;
  for (const MadeModel& model : made) all.insert(all.end(), model.untried.begin(), model.untried.end());
  return all;
}

Result<std::vector<MadeModel>> add_models(project::Scenario& scenario, const project::Plan& plan,
                                          const std::filesystem::path& folder, bool keeps) {
  std::vector<MadeModel> made;
  std::set<std::string> modelled;
  for (const project::ModelEntry& model : scenario.project.models)
    modelled.insert(model.serves.begin(), model.serves.end());
  const MissionDistinctions mission(plan);
  for (const project::ServiceEntry& service : scenario.project.services) {
    if (service.at == "topics" || modelled.contains(service.name)) continue;
    auto reply = any_reply(plan, mission, service.name);
    if (!reply) return tl::unexpected(reply.error());
    if (reply->unsure && !keeps) {
      reply->unsure->message += ". Write a model of the service; sentree verify --model writes one to begin with";
      return tl::unexpected(*reply->unsure);
    }
    const std::filesystem::path file = folder / (service.name + ".scxml");
    std::error_code error;
    if (keeps && std::filesystem::exists(file, error) && text::read_file(file) != reply->chart) {
      return tl::unexpected(Diagnostic{Severity::kError, "verify.any-reply",
                                       "is there already and says something else; name it under `models:`, or take it "
                                       "away",
                                       SourceSpan{file.string()}});
    }
    std::filesystem::create_directories(folder, error);
    if (const auto written = text::write_file(file, reply->chart); !written) return tl::unexpected(written.error());
    const auto absolute = std::filesystem::absolute(file, error);
    const std::string path =
        std::filesystem::relative(absolute, std::filesystem::absolute(scenario.project.folder, error), error).string();
    made.push_back({.service = service.name,
                    .file = path,
                    .tried = std::move(reply->tried),
                    .untried = std::move(reply->untried),
                    .unsure = std::move(reply->unsure)});
  }
  for (const MadeModel& model : made) {
    const std::string name = project::kAnyReplyPrefix + model.service;
    project::ModelEntry entry;
    entry.name = name;
    entry.file.path = model.file;
    entry.serves = {model.service};
    scenario.project.models.push_back(std::move(entry));
    text::YamlNode& models = text::member(text::member(scenario.source, "override"), "models");
    models.kind = text::YamlNode::Kind::kSequence;
    text::YamlNode& item = models.items.emplace_back();
    text::set_scalar(item, "file", model.file);
    text::set_scalar(item, "name", name);
    text::YamlNode& serves = text::member(item, "serves");
    serves.kind = text::YamlNode::Kind::kSequence;
    serves.items.emplace_back().kind = text::YamlNode::Kind::kScalar;
    serves.items.back().scalar = model.service;
  }
  return made;
}

}  // namespace sentree::verify
