#include "sentree/monitor/detail/chart_text.h"

#include <fmt/format.h>

#include "sentree/text/xml.h"

namespace sentree::monitor {

std::string assign(const std::string& location, const std::string& expression) {
  return fmt::format("<assign location=\"{}\" expr=\"{}\"/>", location, text::xml_escape(expression));
}

// Comments must not hold two hyphens in a row, nor end with one.
std::string comment(std::string text) {
  for (std::size_t at = text.find("--"); at != std::string::npos; at = text.find("--", at + 1))
    text.insert(at + 1, " ");
  return fmt::format("<!-- {} -->", text);
}

std::string delay(Duration time) {
  const std::int64_t ns = time.count();
  if (ns % 1'000'000'000 == 0) return fmt::format("{}s", ns / 1'000'000'000);
  if (ns % 1'000'000 == 0) return fmt::format("{}ms", ns / 1'000'000);
  std::string digits = std::to_string(ns % 1'000'000);
  digits.insert(0, 6 - digits.size(), '0');
  while (digits.back() == '0') digits.pop_back();
  return fmt::format("{}.{}ms", ns / 1'000'000, digits);
}

std::string condition_attribute(const Js& condition) {
  return is_true(condition) ? "" : fmt::format(" cond=\"{}\"", text::xml_escape(condition.text));
}

std::string edge_text(const Edge& edge, std::string_view indent) {
  std::string out =
      fmt::format("{}<transition event=\"{}\"{}{}", indent, edge.event, condition_attribute(edge.condition),
                  edge.target.empty() ? "" : fmt::format(" target=\"{}\"", edge.target));
  if (edge.actions.empty()) return out + "/>\n";
  out += ">\n";
  for (const std::string& action : edge.actions) out += fmt::format("{}  {}\n", indent, action);
  return out + fmt::format("{}</transition>\n", indent);
}

std::string state_text(const ChartState& state, std::optional<Duration> deadline, const std::string& counted) {
  std::string out = fmt::format("\n    {}\n    <state id=\"{}\">\n", comment(state.says), state.id);
  if (!state.on_entry.empty()) {
    out += "      <onentry>\n";
    for (const std::string& action : state.on_entry) out += fmt::format("        {}\n", action);
    out += "      </onentry>\n";
  }
  if (deadline && state.begins_anew) {
    out += fmt::format(
        "      <onentry><send event=\"deadline\" id=\"deadline\" delay=\"{}\"/></onentry>\n      <onexit><cancel "
        "sendid=\"deadline\"/></onexit>\n",
        delay(*deadline));
  }
  std::vector<std::string> on_exit = state.on_exit;
  if (!counted.empty() && state.begins_anew) on_exit.push_back(assign(counted, "0"));
  for (const std::string& action : on_exit) out += fmt::format("      <onexit>{}</onexit>\n", action);
  for (const Edge& edge : state.edges) out += edge_text(edge, "      ");
  return out + "    </state>\n";
}

}  // namespace sentree::monitor
