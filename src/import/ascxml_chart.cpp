#include "sentree/import/detail/ascxml_chart.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "sentree/import/detail/ascxml_declarations.h"
#include "sentree/import/detail/project_writer.h"
#include "sentree/import/detail/snippet.h"
#include "sentree/import/detail/words.h"
#include "sentree/import/detail/xml_rewrite.h"
#include "sentree/scxml/format.h"

namespace sentree::import {

using text::XmlDocument;
using text::XmlElement;

namespace {

constexpr std::string_view kNamespace = "http://www.w3.org/2005/07/scxml";
constexpr std::string_view kRequestData = "_event.data.args.";
constexpr std::string_view kReplyData = "_event.data.result.";
constexpr std::string_view kTopicData = "_event.data.";

std::string zero_of(std::string_view thrift) {
  if (thrift == "bool") return "false";
  if (thrift == "string") return "''";
  return thrift.starts_with("list") ? "[]" : "0";
}

std::string replaced(std::string text, std::string_view word, std::string_view with) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at)) {
    if (at > 0 && (is_word(text[at - 1]) || text[at - 1] == '.')) {
      at += word.size();
      continue;
    }
    text.replace(at, word.size(), with);
    at += with.size();
  }
  return text;
}

class AscxmlTranslator {
 public:
  AscxmlTranslator(const AscxmlChart& chart, RosWorld& world)
      : chart_(chart), document_(*chart.document), world_(world), declarations_(declarations_of(chart)) {
    for (const PortDeclaration& port : ports_of(document_)) {
      if (std::none_of(declarations_.begin(), declarations_.end(), [&](const auto& d) { return d.key == port.key; }))
        ports_.push_back(port);
    }
  }

  TranslatedAscxml run() {
    const XmlElement root = document_.root();
    const std::string inside =
        rewritten_inside(document_, root, [&](const XmlElement& child) { return outside(child); });
    const std::string initial(root.attribute("initial").value_or(""));
    std::string body = inside;
    std::string begin = initial;
    if (!rates_.empty()) {
      // The clock goes on whatever the chart does, so it is a region beside it.
      body = fmt::format("\n<parallel id=\"chart.and.clock\">\n<state id=\"chart\"{}>{}</state>\n{}</parallel>\n",
                         initial.empty() ? std::string() : text::xml_attribute("initial", initial), inside, rates_);
      begin = "chart.and.clock";
    }
    std::string text(std::string_view(document_.source()).substr(0, root.offset()));
    text += fmt::format("<scxml{} version=\"1.0\" datamodel=\"ecmascript\"{}{}>\n",
                        text::xml_attribute("xmlns", kNamespace), text::xml_attribute("name", chart_.name),
                        begin.empty() ? "" : text::xml_attribute("initial", begin));
    text += fmt::format("<datamodel>\n{}{}</datamodel>\n{}</scxml>\n", extra_data(), data_, body);
    if (auto formatted = scxml::format(text, document_.file())) text = std::move(*formatted);
    TranslatedAscxml made{std::move(text), {}, std::move(subscribes_), std::move(findings_)};
    for (const Declaration& declaration : declarations_) {
      if (declaration.group == Declaration::Group::kAction && !declaration.serves)
        made.goal_counters.push_back(goal_data(declaration));
    }
    return made;
  }

 private:
  std::string by_hand(const XmlElement& element, std::string reason) {
    const std::string original(source_of(document_, element));
    findings_.push_back({Fate::kByHand, element.span(), shortened(original), std::move(reason)});
    return comment_of("not translated, see IMPORT.md: " + original);
  }

  std::string extra_data() {
    std::string text;
    for (const PortDeclaration& port : ports_) {
      if (data_.find(fmt::format("<data id=\"{}\"", port.key)) != std::string::npos) continue;
      text += fmt::format("<data{}{}/> <!-- {} port -->\n", text::xml_attribute("id", port.key),
                          text::xml_attribute("expr", zero_of(thrift_type(port.type).value_or("double"))),
                          port.is_input ? "input" : "output");
    }
    for (const Declaration& declaration : declarations_) {
      if (declaration.group == Declaration::Group::kAction && !declaration.serves)
        text += fmt::format("<data{} expr=\"0\"/> <!-- number of the last goal -->\n",
                            text::xml_attribute("id", goal_data(declaration)));
    }
    if (draws_ > 0) text += "<data id=\"drawn\" expr=\"0\"/>\n";
    return text;
  }

  static std::string goal_data(const Declaration& action) { return method_name(action.name) + "_goal_id"; }

  std::string outside(const XmlElement& element) {
    const std::string name(element.local_name());
    if (const auto declaration = declaration_of(element, chart_.ports)) return declared(element, *declaration);
    if (name == "bt_declare_port_in" || name == "bt_declare_port_out") return {};
    if (name == "datamodel") {
      for (const XmlElement& child : element.children()) data_ += data(child) + "\n";
      return {};
    }
    if (name == "state" || name == "parallel" || name == "final") return state(element);
    if (name == "transition" || name.starts_with("bt_") || name.starts_with("ros_")) return reaction(element);
    if (name == "onentry" || name == "onexit") return element_text(element, start_tag(element), content(element));
    if (name == "script") return by_hand(element, "a script of the whole chart; put it into the <onentry> of a state");
    if (name == "initial" || name == "history" || name == "invoke" || name == "donedata")
      return std::string(source_of(document_, element));
    return by_hand(element, fmt::format("nothing here does what <{}> does", name));
  }

  std::string declared(const XmlElement& element, const Declaration& declaration) {
    if (declaration.group == Declaration::Group::kRate) {
      if (declaration.rate_hz <= 0) return by_hand(element, "a rate that is no number above 0");
      const std::string id = "clock." + method_name(declaration.name);
      std::ostringstream delay;
      delay << 1000.0 / declaration.rate_hz << "ms";
      rates_ += fmt::format("<state{}>\n<onentry>\n<send{}{}/>\n</onentry>\n<transition{}{}/>\n</state>\n",
                            text::xml_attribute("id", id), text::xml_attribute("event", rate_event(declaration)),
                            text::xml_attribute("delay", delay.str()),
                            text::xml_attribute("event", rate_event(declaration)), text::xml_attribute("target", id));
      return {};
    }
    if (declaration.ros_name.empty())
      return by_hand(element, "its name comes from a port whose value the tree does not give as text");
    return comment_of(fmt::format("{} {} {}", element.local_name(), declaration.ros_name, declaration.type));
  }

  static std::string rate_event(const Declaration& rate) { return "rate." + method_name(rate.name); }

  std::string data(const XmlElement& element) {
    if (element.local_name() != "data") return std::string(source_of(document_, element));
    const std::string type(element.attribute("type").value_or(""));
    std::string value = value_of(element, "expr");
    if (value.empty()) value = trimmed(element.text());
    if (value.empty()) value = zero_of(thrift_type(type).value_or("double"));
    std::string text = fmt::format("<data{}{}/>", text::xml_attribute("id", element.attribute("id").value_or("")),
                                   text::xml_attribute("expr", value));
    return type.empty() ? text : fmt::format("{} {}", text, comment_of(type));
  }

  std::string state(const XmlElement& element) {
    const std::string id_before = state_id_;
    std::string behind;
    behind.swap(behind_);
    state_id_ = element.attribute("id").value_or("");
    std::string text =
        element_text(element, start_tag(element),
                     rewritten_inside(document_, element, [&](const XmlElement& child) { return outside(child); }));
    text += behind_;
    behind_ = std::move(behind);
    state_id_ = id_before;
    return text;
  }

  /// Elements that stand where a transition stands.
  std::string reaction(const XmlElement& element) {
    const std::string name(element.local_name());
    const std::string ref(element.attribute("name").value_or(""));
    if (name == "transition") {
      std::vector<std::string> events = words(element.attribute("event").value_or(""));
      const bool is_event = !events.empty();
      for (std::string& event : events) {
        if (!is_cross(world_, event)) continue;
        event = topic_event(event);
      }
      std::string joined;
      for (const std::string& event : events) joined += (joined.empty() ? "" : " ") + event;
      return transition(element, is_event ? joined : "", "");
    }
    if (name == "bt_tick") return transition(element, "bt_tick", refreshed_ports());
    if (name == "bt_halt") return transition(element, "bt_halt", "");
    if (name == "ros_rate_callback") {
      const Declaration* const rate = import::find(declarations_, Declaration::Group::kRate, ref);
      return rate != nullptr ? transition(element, rate_event(*rate), "") : undeclared(element);
    }
    if (name == "ros_topic_callback") {
      const Declaration* const topic = import::find(declarations_, Declaration::Group::kTopic, ref, false);
      return known(topic) ? transition(element, topic_event(method_name(topic->ros_name)), "") : undeclared(element);
    }
    if (name == "ros_service_handle_request" || name == "ros_service_handle_response") {
      const bool serves = name.ends_with("request");
      const Declaration* const service = import::find(declarations_, Declaration::Group::kService, ref, serves);
      if (!known(service)) return undeclared(element);
      if (!serves && !chart_.is_plugin) return calls_from_a_node(element);
      const RosPlace& place = world_.services.at(service->ros_name);
      return transition(element, fmt::format("{}.{}{}", place.service, place.method, serves ? ".request" : ".reply"),
                        "");
    }
    if (name.starts_with("ros_action_handle_")) return action_reaction(element, name, ref);
    return by_hand(element, fmt::format("nothing here does what <{}> does", name));
  }

  static bool known(const Declaration* declaration) { return declaration != nullptr && !declaration->ros_name.empty(); }

  std::string undeclared(const XmlElement& element) {
    return by_hand(element, fmt::format("the chart does not declare \"{}\"", element.attribute("name").value_or("")));
  }

  std::string action_reaction(const XmlElement& element, const std::string& name, const std::string& ref) {
    const bool serves = name == "ros_action_handle_goal";
    const Declaration* const action = import::find(declarations_, Declaration::Group::kAction, ref, serves);
    if (!known(action)) return undeclared(element);
    const RosPlace& place = world_.actions.at(action->ros_name);
    const std::string goal = fmt::format("{}.{}_send_goal", place.service, place.method);
    if (serves) return transition(element, goal + ".request", "");
    if (!chart_.is_plugin) return calls_from_a_node(element);
    const std::string mine = fmt::format("{}goal_id === {}", kTopicData, goal_data(*action));
    if (name == "ros_action_handle_goal_response") {
      const auto to = [&](std::string_view target, const std::string& accepted) {
        return fmt::format("<transition{}{}{}/>\n", text::xml_attribute("event", goal + ".reply"),
                           text::xml_attribute("cond", accepted),
                           text::xml_attribute("target", element.attribute(target).value_or("")));
      };
      return to("accept", "_event.data.result") + to("reject", "!_event.data.result");
    }
    if (name == "ros_action_handle_feedback")
      return transition(element, topic_event(place.method + "_feedback"), "", mine);
    static const std::map<std::string, std::string> kStatus = {{"ros_action_handle_success_result", "SUCCEEDED"},
                                                               {"ros_action_handle_aborted_result", "ABORTED"},
                                                               {"ros_action_handle_canceled_result", "CANCELED"}};
    const auto status = kStatus.find(name);
    if (status == kStatus.end()) return by_hand(element, fmt::format("nothing here does what <{}> does", name));
    return transition(element, topic_event(place.method + "_result"), "",
                      fmt::format("{} && {}status === '{}'", mine, kTopicData, status->second));
  }

  std::string calls_from_a_node(const XmlElement& element) {
    return by_hand(element,
                   "a node that is a client: the model of a component answers and publishes, and calls nobody");
  }

  std::string topic_event(const std::string& method) {
    return *subscribes_.insert(fmt::format("{}.{}", kTopics, method)).first;
  }

  /// The ports' values as this tick has them.
  std::string refreshed_ports() {
    std::string text;
    for (const PortDeclaration& port : ports_) {
      if (!port.is_input) continue;
      if (chart_.sometimes.contains(port.key)) {
        const std::string value = "_event.data." + port.key;
        text += fmt::format("<if{}>\n<assign{}{}/>\n</if>\n",
                            text::xml_attribute("cond", fmt::format("_event.data && {} !== undefined", value)),
                            text::xml_attribute("location", port.key), text::xml_attribute("expr", value));
      }
      if (chart_.given.contains(port.key))
        text += fmt::format("<assign{}{}/>\n", text::xml_attribute("location", port.key),
                            text::xml_attribute("expr", "_event.data." + port.key));
    }
    return text;
  }

  std::string transition(const XmlElement& element, const std::string& event, const std::string& first,
                         const std::string& also = "") {
    std::string condition(element.attribute("cond").value_or(""));
    condition = expression(condition);
    if (!also.empty()) condition = condition.empty() ? also : fmt::format("{} && ({})", also, condition);
    std::string tag = "<transition";
    if (!event.empty()) tag += text::xml_attribute("event", event);
    if (!condition.empty()) tag += text::xml_attribute("cond", condition);
    std::vector<XmlElement> chances;
    for (const XmlElement& child : element.children()) {
      if (child.local_name() == "target") chances.push_back(child);
    }
    if (!chances.empty()) {
      const std::string choice = chance(element, chances);
      return tag + text::xml_attribute("target", choice) +
             (first.empty() ? "/>" : fmt::format(">\n{}</transition>", first));
    }
    if (const auto target = element.attribute("target")) tag += text::xml_attribute("target", *target);
    const std::string inside = first + content(element);
    if (inside.find_first_not_of(" \t\r\n") == std::string::npos) return tag + "/>";
    return fmt::format("{}>\n{}</transition>", tag, inside);
  }

  /// A state that draws one of the targets; it stands behind the present state. Returns its id.
  std::string chance(const XmlElement& element, const std::vector<XmlElement>& targets) {
    std::string id = fmt::format("{}.chance{}", state_id_, ++draws_);
    std::string text =
        fmt::format("<state{}>\n<onentry>\n<assign location=\"drawn\" expr=\"Math.random()\"/>\n</onentry>\n",
                    text::xml_attribute("id", id));
    double sum = 0;
    std::size_t without = 0;
    for (const XmlElement& target : targets) without += target.attribute("prob") ? 0 : 1;
    double given = 0;
    for (const XmlElement& target : targets)
      given += std::atof(std::string(target.attribute("prob").value_or("0")).c_str());
    for (const XmlElement& target : targets) {
      const auto written = target.attribute("prob");
      sum += written ? std::atof(std::string(*written).c_str()) : (1.0 - given) / static_cast<double>(without);
      std::ostringstream below;
      below << "drawn < " << sum;
      const bool is_last = &target == &targets.back() && sum > 1.0 - 1e-9;
      text += fmt::format("<transition{}{}>{}</transition>\n",
                          is_last ? std::string() : text::xml_attribute("cond", below.str()),
                          text::xml_attribute("target", target.attribute("id").value_or("")), content(target));
    }
    if (sum < 1.0 - 1e-9) {
      findings_.push_back({Fate::kReview, element.span(), "",
                           "the probabilities are less than 1 together; the rest goes back to the state"});
      text += fmt::format("<transition{}/>\n", text::xml_attribute("target", state_id_));
    }
    behind_ += fmt::format("\n{}</state>\n", text);
    return id;
  }

  std::string content(const XmlElement& parent) {
    return rewritten_inside(document_, parent, [&](const XmlElement& child) { return executable(child); });
  }

  [[nodiscard]] static std::string expression(std::string text) {
    text = replaced(std::move(text), "_msg.", kTopicData);
    text = replaced(std::move(text), "_req.", kRequestData);
    text = replaced(std::move(text), "_res.", kReplyData);
    text = replaced(std::move(text), "_goal.", kRequestData);
    text = replaced(std::move(text), "_action.", kRequestData);
    text = replaced(std::move(text), "_wrapped_result.result.", kTopicData);
    text = replaced(std::move(text), "_feedback.", kTopicData);
    return text;
  }

  std::string executable(const XmlElement& element) {
    const std::string name(element.local_name());
    const std::string ref(element.attribute("name").value_or(""));
    if (name == "bt_return_status") return answer(std::string(element.attribute("status").value_or("")));
    if (name == "bt_return_halted") return "<send event=\"bt_return_halted\"/>";
    if (name == "bt_set_output") {
      return fmt::format("<assign{}{}/>", text::xml_attribute("location", element.attribute("key").value_or("")),
                         text::xml_attribute("expr", expression(value_of(element, "expr"))));
    }
    if (name == "ros_topic_publish") {
      const Declaration* const topic = import::find(declarations_, Declaration::Group::kTopic, ref, true);
      if (!known(topic)) return undeclared(element);
      return publish(method_name(topic->ros_name), fields_of(element));
    }
    if (name == "ros_service_send_request" || name == "ros_service_send_response") {
      const bool serves = name.ends_with("response");
      const Declaration* const service = import::find(declarations_, Declaration::Group::kService, ref, serves);
      if (!known(service)) return undeclared(element);
      const RosPlace& place = world_.services.at(service->ros_name);
      const RosMethod& method = world_.interfaces.method(place.service, place.method);
      if (serves) return reply(place.service, place.method, object(completed(method.result, fields_of(element))));
      if (!chart_.is_plugin) return calls_from_a_node(element);
      return call(place.service, place.method, completed(method.arguments, fields_of(element)));
    }
    if (name.starts_with("ros_action_")) return action(element, name, ref);
    if (name == "send" && element.attribute("event")) {
      const std::string event(*element.attribute("event"));
      if (event == "bt_success") return answer("SUCCESS");
      if (event == "bt_failure") return answer("FAILURE");
      if (event == "bt_running") return answer("RUNNING");
      if (is_cross(world_, event) && !element.attribute("target")) return publish(event, fields_of(element));
    }
    if (name.starts_with("bt_") || name.starts_with("ros_"))
      return by_hand(element, fmt::format("nothing here does what <{}> does", name));
    if (!is_content(name)) return by_hand(element, fmt::format("nothing here does what <{}> does", name));
    std::map<std::string, std::optional<std::string>> changes;
    element.for_each_attribute([&](std::string_view attribute, std::string_view value) {
      if (attribute == "cond" || attribute == "expr" || attribute == "location")
        changes[std::string(attribute)] = expression(std::string(value));
    });
    if (element.child("expr")) {
      changes["expr"] = expression(value_of(element, "expr"));
      return start_tag(element, changes) + "/>";
    }
    return element_text(element, start_tag(element, changes), content(element));
  }

  static bool is_content(std::string_view name) {
    static constexpr std::array<std::string_view, 12> kContent{
        "raise", "send", "cancel", "assign", "log", "script", "if", "else", "elseif", "foreach", "param", "content"};
    return std::find(kContent.begin(), kContent.end(), name) != kContent.end();
  }

  std::string answer(const std::string& status) {
    std::string text = fmt::format("<send event=\"bt_return_status\">\n<param name=\"status\"{}/>\n",
                                   text::xml_attribute("expr", script_text(status)));
    for (const PortDeclaration& port : ports_) {
      if (!port.is_input)
        text +=
            fmt::format("<param{}{}/>\n", text::xml_attribute("name", port.key), text::xml_attribute("expr", port.key));
    }
    return text + "</send>";
  }

  std::string action(const XmlElement& element, const std::string& name, const std::string& ref) {
    const bool serves = name != "ros_action_send_goal";
    const Declaration* const declaration = import::find(declarations_, Declaration::Group::kAction, ref, serves);
    if (!known(declaration)) return undeclared(element);
    const RosPlace& place = world_.actions.at(declaration->ros_name);
    FieldValues fields = fields_of(element);
    const std::string goal = place.method + "_send_goal";
    if (!serves && !chart_.is_plugin) return calls_from_a_node(element);
    if (!serves) {
      const std::string number = goal_data(*declaration);
      fields.insert(fields.begin(), {"goal_id", number});
      return fmt::format(
          "<assign{}{}/>\n{}", text::xml_attribute("location", number), text::xml_attribute("expr", number + " + 1"),
          call(place.service, goal, completed(world_.interfaces.method(place.service, goal).arguments, fields)));
    }
    const std::string id = expression(std::string(element.attribute("goal_id").value_or("0")));
    if (name == "ros_action_accept_goal") return reply(place.service, goal, "true");
    if (name == "ros_action_reject_goal") return reply(place.service, goal, "false");
    fields.insert(fields.begin(), {"goal_id", id});
    if (name == "ros_action_feedback") return publish(place.method + "_feedback", fields);
    static const std::map<std::string, std::string> kStatus = {
        {"ros_action_succeed", "SUCCEEDED"}, {"ros_action_aborted", "ABORTED"}, {"ros_action_canceled", "CANCELED"}};
    const auto status = kStatus.find(name);
    if (status == kStatus.end()) return by_hand(element, fmt::format("nothing here does what <{}> does", name));
    fields.insert(fields.begin() + 1, {"status", fmt::format("'{}'", status->second)});
    return publish(place.method + "_result", fields);
  }

  // What nobody gives has the value that a new ROS message has.
  [[nodiscard]] FieldValues completed(const Fields& all, const FieldValues& given) const {
    FieldValues fields;
    for (const std::string& name : all.names()) {
      const auto value =
          std::find_if(given.begin(), given.end(), [&](const auto& field) { return field.first == name; });
      fields.emplace_back(name, value == given.end() ? zero_of(all.type(name)) : expression(value->second));
    }
    return fields;
  }

  // {a: …, b: {c: …}}; empty without fields.
  static std::string object(const FieldValues& fields) {
    std::string text;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::size_t dot = fields[i].first.find('.');
      const std::string head = fields[i].first.substr(0, dot);
      const bool seen =
          std::any_of(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(i),
                      [&](const auto& field) { return field.first.substr(0, field.first.find('.')) == head; });
      if (seen) continue;
      text += fmt::format("{}{}: {}", text.empty() ? "" : ", ", head, member(fields, head));
    }
    return text.empty() ? "" : fmt::format("{{{}}}", text);
  }

  static std::string member(const FieldValues& fields, const std::string& head) {
    FieldValues inside;
    for (const auto& [name, value] : fields) {
      if (name == head) return value;
      if (name.starts_with(head + ".")) inside.emplace_back(name.substr(head.size() + 1), value);
    }
    return object(inside);
  }

  static std::string call(const std::string& service, const std::string& method, const FieldValues& fields) {
    RemoteCall call{"", service, method, {}, false};
    for (const auto& [name, value] : fields) {
      const std::string head = name.substr(0, name.find('.'));
      if (std::none_of(call.arguments.begin(), call.arguments.end(),
                       [&](const auto& known) { return known.first == head; }))
        call.arguments.emplace_back(head, member(fields, head));
    }
    return send_of(call, "");
  }

  std::string publish(const std::string& method, const FieldValues& fields) {
    return call(std::string(kTopics), method,
                completed(world_.interfaces.method(std::string(kTopics), method).arguments, fields));
  }

  static std::string reply(const std::string& service, const std::string& method, const std::string& result) {
    std::string text = fmt::format("<send type=\"thrift\"{}{}", text::xml_attribute("target", service),
                                   text::xml_attribute("event", method + ".reply"));
    if (result.empty()) return text + "/>";
    return fmt::format("{}>\n<param name=\"result\"{}/>\n</send>", text, text::xml_attribute("expr", result));
  }

  const AscxmlChart& chart_;
  const XmlDocument& document_;
  RosWorld& world_;
  std::vector<Declaration> declarations_;
  std::vector<PortDeclaration> ports_;
  std::vector<Finding> findings_;
  std::string data_;
  std::string rates_;
  std::string state_id_;
  std::string behind_;
  int draws_ = 0;
  std::set<std::string> subscribes_;
};

}  // namespace

TranslatedAscxml translate(const AscxmlChart& chart, RosWorld& world) { return AscxmlTranslator(chart, world).run(); }

}  // namespace sentree::import
