#include <fmt/format.h>

#include <charconv>
#include <utility>

#include "sentree/scxml/loader.h"
#include "sentree/text/json.h"

namespace sentree::scxml {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

}  // namespace

std::optional<Duration> parse_delay(std::string_view text, bool* has_unit) {
  while (!text.empty() && kSpace.find(text.front()) != std::string_view::npos) text.remove_prefix(1);
  while (!text.empty() && kSpace.find(text.back()) != std::string_view::npos) text.remove_suffix(1);
  double unit = 1e-3;
  if (has_unit) *has_unit = text.ends_with('s') || text == "0";
  if (text.ends_with("ms")) {
    text.remove_suffix(2);
  } else if (text.ends_with('s')) {
    unit = 1.0;
    text.remove_suffix(1);
  }
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.empty() || text.find_first_not_of("0123456789.") != std::string_view::npos) return std::nullopt;
  double number = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), number, std::chars_format::fixed);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return from_seconds(number * unit);
}

std::string normalize_space(std::string_view text) {
  std::string result;
  bool gap = false;
  for (const char c : text) {
    if (kSpace.find(c) != std::string_view::npos) {
      gap = !result.empty();
      continue;
    }
    if (gap) result += ' ';
    gap = false;
    result += c;
  }
  return result;
}

Value value_of_text(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return std::string();
  if (text[first] == '<') {
    if (text::XmlDocument::parse(std::string(text.substr(first)))) return tag_xml(text.substr(first));
  } else if (auto json = text::parse_json(text)) {
    return *std::move(json);
  }
  return normalize_space(text);
}

std::optional<Value> Loader::inline_content(const Element& element) {
  if (element.first_child()) {
    const std::string_view source = element.inner_source();
    const std::size_t begin = source.find('<');
    const std::size_t end = source.rfind('>');
    return tag_xml(source.substr(begin, end - begin + 1));
  }
  const std::string text = element.text();
  if (text.find_first_not_of(kSpace) == std::string::npos) return std::nullopt;
  return value_of_text(text);
}

Result<std::string> Loader::read(std::string_view uri) const {
  if (!options_.read)
    return fail("scxml.unreadable", fmt::format("\"{}\" cannot be read: no other documents are available here", uri));
  return options_.read(seen_from(model_->folder, uri));
}

std::string seen_from(std::string_view folder, std::string_view uri) {
  // A relative reference, though with a scheme: as W3C's tests and Qt's charts write it.
  constexpr std::string_view kFile = "file:";
  if (uri.starts_with(kFile)) uri.remove_prefix(kFile.size());
  const std::size_t colon = uri.find(':');
  const bool is_relative = !uri.starts_with('/') && (colon == uri.npos || uri.find('/') < colon);
  return std::string(is_relative ? folder : std::string_view()).append(uri);
}

std::string folder_of(std::string_view uri) { return std::string(uri.substr(0, uri.rfind('/') + 1)); }

ExpressionId Loader::add_expression(std::string_view text, ExpressionUse use, const Place& place) {
  if (text.size() > options_.limits.expression_bytes_max) {
    error("scxml.too-large",
          fmt::format("the expression is longer than {} bytes", options_.limits.expression_bytes_max), place);
  }
  const auto id = static_cast<ExpressionId>(model_->expressions.size());
  Expression& expression = model_->expressions.emplace_back();
  expression.text = text;
  expression.use = use;
  expression.place = place;
  return id;
}

ExpressionId Loader::load_expression(const Element& element, std::string_view attribute, ExpressionUse use) {
  const auto text = given(element, attribute);
  return text ? add_expression(*text, use, value_place(element, attribute)) : kNoExpression;
}

Text Loader::load_text(const Element& element, std::string_view name, std::string_view expr_name,
                       Place* constant_place) {
  Text text;
  const auto constant = given(element, name);
  text.expr = load_expression(element, expr_name, ExpressionUse::kValue);
  if (!constant) return text;
  if (text.expr != kNoExpression) {
    wrong("scxml.bad-attribute",
          fmt::format("<{}> has both \"{}\" and \"{}\"; keep one", element.local_name(), name, expr_name),
          attribute_place(element, expr_name));
  }
  text.constant = *constant;
  if (constant_place) *constant_place = value_place(element, name);
  return text;
}

void Loader::stray_text(const Element& element) {
  std::string text = element.text();
  text.erase(0, text.find_first_not_of(kSpace));
  if (text.empty()) return;
  text.resize(std::min(text.size(), text.find_first_of(kSpace)));
  warn("scxml.text", fmt::format("text inside <{}> means nothing: \"{}\"", element.local_name(), text), place(element));
}

Block Loader::load_block(const Element& element, int depth) {
  Block block;
  stray_text(element);
  if (!element.first_child() || too_deep(element, depth)) return block;
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) {
      if (is_editor_data(child)) continue;
      model_->passed_over = true;
      warn("scxml.foreign-content", fmt::format("<{}> is not SCXML and does nothing", child.name()), place(child));
      continue;
    }
    if (!load_action(child, depth + 1, block)) {
      unknown_element(child, element.local_name(),
                      {"raise", "send", "cancel", "assign", "log", "script", "if", "foreach"});
    }
  }
  return block;
}

bool Loader::load_action(const Element& element, int depth, Block& block) {
  const std::string_view name = element.local_name();
  const Place where = place(element);
  if (name == "raise") {
    know_attributes(element, {"event"});
    model_->raises.emplace_back(required(element, "event"), where);
    block.push_back({Raise{model_->raises.back().first}, where});
  } else if (name == "log") {
    know_attributes(element, {"label", "expr"});
    block.push_back({Log{std::string(element.attribute("label").value_or("")),
                         load_expression(element, "expr", ExpressionUse::kValue)},
                     where});
  } else if (name == "assign") {
    block.push_back({load_assign(element), where});
  } else if (name == "script") {
    block.push_back({load_script(element), where});
  } else if (name == "cancel") {
    know_attributes(element, {"sendid", "sendidexpr"});
    const Text id = load_text(element, "sendid", "sendidexpr");
    // An empty one cancels nothing.
    if (!id.absent())
      block.push_back({Cancel{id.constant, id.expr}, where});
    else if (!element.attribute("sendid"))
      required(element, "sendid");
  } else if (name == "send") {
    block.push_back({load_send(element), where});
  } else if (name == "if") {
    block.push_back({load_if(element, depth), where});
  } else if (name == "foreach") {
    know_attributes(element, {"array", "item", "index"});
    required(element, "array");
    required(element, "item");
    Foreach loop;
    loop.array = load_expression(element, "array", ExpressionUse::kValue);
    loop.item = load_expression(element, "item", ExpressionUse::kItem);
    loop.index = load_expression(element, "index", ExpressionUse::kItem);
    loop.body = std::make_unique<Block>(load_block(element, depth));
    block.push_back({std::move(loop), where});
  } else {
    return false;
  }
  return true;
}

If Loader::load_if(const Element& element, int depth) {
  know_attributes(element, {"cond"});
  If result;
  if (too_deep(element, depth)) return result;
  required(element, "cond");
  result.branches.push_back({load_expression(element, "cond", ExpressionUse::kCondition), {}});
  bool has_else = false;
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) continue;
    const std::string_view name = child.local_name();
    if (name == "elseif" || name == "else") {
      if (has_else) wrong("scxml.misplaced-element", fmt::format("<{}> follows <else>", name), place(child));
      has_else = name == "else";
      if (has_else)
        know_attributes(child, {});
      else
        know_attributes(child, {"cond"}), required(child, "cond");
      result.branches.push_back(
          {has_else ? kNoExpression : load_expression(child, "cond", ExpressionUse::kCondition), {}});
      // SCXML 4.3: they divide what follows. What stands in them would be lost.
      if (child.first_child()) {
        refuse("scxml.misplaced-element",
               fmt::format("the content of <{}> follows it: write <{}/> before it", name, name), place(child));
        result.branches.back().body = load_block(child, depth + 1);
      }
    } else if (!load_action(child, depth + 1, result.branches.back().body)) {
      unknown_element(child, "if",
                      {"elseif", "else", "raise", "send", "cancel", "assign", "log", "script", "if", "foreach"});
    }
  }
  return result;
}

Send Loader::load_send(const Element& element) {
  know_attributes(element, {"event", "eventexpr", "target", "targetexpr", "type", "typeexpr", "id", "idlocation",
                            "delay", "delayexpr", "namelist"});
  Send send;
  SendInfo info;
  send.event = load_text(element, "event", "eventexpr", &info.event_place);
  send.target = load_text(element, "target", "targetexpr", &info.target_place);
  send.type = load_text(element, "type", "typeexpr");
  send.delay = load_text(element, "delay", "delayexpr");
  send.id = element.attribute("id").value_or("");
  send.idlocation = load_expression(element, "idlocation", ExpressionUse::kLocation);
  if (!send.id.empty() && send.idlocation != kNoExpression) {
    wrong("scxml.bad-attribute", "<send> has both \"id\" and \"idlocation\"; keep one",
          attribute_place(element, "idlocation"));
  }
  if (!send.delay.constant.empty()) {
    bool has_unit = true;
    const auto delay = parse_delay(send.delay.constant, &has_unit);
    if (!delay) {
      wrong("scxml.bad-attribute",
            fmt::format("delay \"{}\" is no time; write a number with s or ms, as in \"1.5s\"", send.delay.constant),
            value_place(element, "delay"));
    } else if (!has_unit) {
      warn("scxml.no-unit",
           fmt::format("delay \"{}\" has no unit and is taken as milliseconds; write \"{}ms\", or \"s\" for seconds",
                       send.delay.constant, normalize_space(send.delay.constant)),
           value_place(element, "delay"));
    }
    send.delay_constant = delay.value_or(Duration(0));
  }
  if (send.target.constant == "#_internal" && !send.delay.absent()) {
    error("scxml.bad-attribute", "a <send> to #_internal cannot be delayed",
          attribute_place(element, send.delay.expr == kNoExpression ? "delay" : "delayexpr"));
  }
  send.payload = load_payload(element, true, &info);
  if (send.event.absent() && !send.payload.has_content && !given(element, "namelist") && send.payload.params.empty()) {
    required(element, "event");
  }
  info.state = state_;
  const auto known = [](const Text& text) {
    return text.expr == kNoExpression ? std::optional(text.constant) : std::nullopt;
  };
  info.type = known(send.type);
  info.target = known(send.target);
  info.event = known(send.event);
  info.id = send.id;
  info.has_content = send.payload.has_content;
  info.place = place(element);
  model_->sends.push_back(std::move(info));
  return send;
}

Payload Loader::load_payload(const Element& element, bool with_namelist, SendInfo* info) {
  Payload payload;
  payload.place = place(element);
  if (with_namelist) {
    const Place where = element.attribute("namelist") ? value_place(element, "namelist") : Place{};
    for_each_name(element.attribute("namelist").value_or(""), [&](std::string_view written) {
      std::string name(written);
      const ExpressionId expr = add_expression(name, ExpressionUse::kValue, where);
      if (info) info->params.push_back({name, std::nullopt, name, where});
      const ExpressionId location = info ? kNoExpression : add_expression(name, ExpressionUse::kLocation, where);
      payload.namelist.push_back({std::move(name), expr, location});
    });
  }
  for (Element child = element.first_child(); child; child = child.next_sibling()) {
    if (!is_scxml(child)) continue;
    const std::string_view name = child.local_name();
    if (name == "param") {
      payload.params.push_back(load_param(child, info));
    } else if (name == "content") {
      know_attributes(child, {"expr"});
      if (payload.has_content) wrong("scxml.misplaced-element", "there can be only one <content>", place(child));
      payload.has_content = true;
      payload.content_expr = load_expression(child, "expr", ExpressionUse::kValue);
      payload.content_source = child.first_child() ? std::string(child.inner_source()) : child.text();
      if (child.first_child()) payload.content_place = place(child.first_child());
      if (payload.content_expr == kNoExpression) payload.content = inline_content(child).value_or(Value(std::string()));
    } else if (element.local_name() != "invoke") {
      unknown_element(child, element.local_name(), {"param", "content"});
    }
  }
  if (payload.has_content && element.local_name() != "invoke" &&
      (!payload.params.empty() || !payload.namelist.empty())) {
    wrong("scxml.misplaced-element",
          fmt::format("<{}> has both <content> and parameters; keep one", element.local_name()), place(element));
  }
  return payload;
}

Param Loader::load_param(const Element& element, SendInfo* info) {
  know_attributes(element, {"name", "expr", "location"});
  Param param;
  param.name = required(element, "name");
  const bool has_expr = given(element, "expr").has_value();
  if (has_expr == given(element, "location").has_value()) {
    refuse("scxml.missing-attribute", "<param> needs either \"expr\" or \"location\"", place(element));
  }
  param.expr = load_expression(element, has_expr ? "expr" : "location", ExpressionUse::kValue);
  if (!has_expr && !info) param.location = load_expression(element, "location", ExpressionUse::kLocation);
  if (info && param.expr != kNoExpression) {
    const std::string& text = model_->expressions[param.expr].text;
    info->params.push_back({param.name, constant_value(text), text, place(element)});
  }
  return param;
}

Assign Loader::load_assign(const Element& element) {
  know_attributes(element, {"location", "expr", "attr", "type"});
  required(element, "location");
  Assign assign;
  assign.location = load_expression(element, "location", ExpressionUse::kLocation);
  assign.expr = load_expression(element, "expr", ExpressionUse::kValue);
  if (assign.expr == kNoExpression) assign.content = inline_content(element);
  return assign;
}

Script Loader::load_script(const Element& element) {
  know_attributes(element, {"src"});
  const auto src = given(element, "src");
  if (!src) {
    // The place of the first byte of the text, so that the interpreter's line numbers can be added to it.
    Place where = place(element);
    const std::string_view inner = element.inner_source();
    const std::size_t offset =
        inner.empty() ? element.offset() : static_cast<std::size_t>(inner.data() - document_.source().data());
    const SourceSpan span = document_.span_at(offset);
    where = {span.line, span.column, static_cast<int>(inner.size())};
    return {add_expression(element.text(), ExpressionUse::kScript, where)};
  }
  auto text = read(*src);
  if (!text) {
    // SCXML 5.8: a document whose script cannot be fetched is refused.
    refuse("scxml.script-unreadable", "the script cannot be read: " + text.error().message,
           value_place(element, "src"));
    return {};
  }
  return {add_expression(*text, ExpressionUse::kScript, value_place(element, "src"))};
}

}  // namespace sentree::scxml
