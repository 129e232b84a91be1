#include "sentree/design/chart_edit.h"

#include <algorithm>
#include <cctype>

#include "sentree/scxml/edit.h"

namespace sentree::design {

namespace {

bool is_id(std::string_view id) {
  return !id.empty() && std::isdigit(static_cast<unsigned char>(id.front())) == 0 &&
         std::all_of(id.begin(), id.end(), [](char c) {
           const auto u = static_cast<unsigned char>(c);
           return std::isalnum(u) != 0 || u >= 0x80 || c == '_' || c == '-' || c == '.';
         });
}

class ChartEditor {
 public:
  explicit ChartEditor(const scxml::Chart& chart) : chart_(chart), edit_(chart) {}

  Result<std::string> operator()(const RenameState& rename) {
    const auto state = find(rename.state);
    if (!state) return tl::unexpected(state.error());
    if (!is_id(rename.id)) return fail("design.bad-name", "\"" + rename.id + "\" is no id of a state");
    if (auto renamed = edit_.rename_state(*state, rename.id); !renamed) return tl::unexpected(renamed.error());
    return "rename " + rename.state + " to " + rename.id;
  }

  Result<std::string> operator()(const AddState& add) {
    scxml::StateIndex parent = 0;
    if (!add.parent.empty()) {
      const auto found = find(add.parent);
      if (!found) return tl::unexpected(found.error());
      if (chart_.states()[*found].kind == scxml::StateKind::kFinal)
        return fail("design.arity", add.parent + " is final: it has no states inside");
      parent = *found;
    }
    if (!is_id(add.id)) return fail("design.bad-name", "\"" + add.id + "\" is no id of a state");
    if (chart_.find(add.id)) return fail("scxml.duplicate-id", "there is a state \"" + add.id + "\" already");
    const std::string element = add.final ? "final" : "state";
    edit_.append_child(edit_.of_state(parent), "<" + element + " id=\"" + add.id + "\"/>");
    return "add state " + add.id;
  }

  Result<std::string> operator()(const RemoveState& remove) {
    const auto state = find(remove.state);
    if (!state) return tl::unexpected(state.error());
    edit_.remove(edit_.of_state(*state));
    return "delete state " + remove.state;
  }

  Result<std::string> operator()(const AddTransition& add) {
    const auto source = find(add.source);
    if (!source) return tl::unexpected(source.error());
    const scxml::State& state = chart_.states()[*source];
    if (state.kind == scxml::StateKind::kFinal || state.is_history())
      return fail("design.arity", "nothing leads out of " + add.source + ", which is final or a history");
    if (!add.target.empty()) {
      if (const auto target = find(add.target); !target) return tl::unexpected(target.error());
    }
    std::string xml = "<transition";
    for (const auto& [name, value] :
         {std::pair("event", add.event), std::pair("cond", add.condition), std::pair("target", add.target)}) {
      if (!value.empty()) xml += std::string(" ") + name + "=\"" + text::xml_escape(value) + "\"";
    }
    edit_.append_child(edit_.of_state(*source), xml + "/>");
    return "add transition from " + add.source + (add.target.empty() ? "" : " to " + add.target);
  }

  [[nodiscard]] Result<std::string> apply() const { return edit_.apply(); }

 private:
  [[nodiscard]] Result<scxml::StateIndex> find(const std::string& id) const {
    if (const auto state = chart_.find(id); state && !id.empty()) return *state;
    return fail("design.no-such-node", "there is no state \"" + id + "\"");
  }

  const scxml::Chart& chart_;
  scxml::ChartEdit edit_;
};

}  // namespace

Result<GestureResult> edit_chart(std::string_view xml, const ChartGesture& gesture, const std::string& file) {
  scxml::LoadOptions options;
  // What it names elsewhere does not change with it.
  options.read = [](std::string_view) -> Result<std::string> { return std::string(); };
  const auto chart = scxml::load(xml, file, options);
  if (!chart.value) {
    const auto error = std::find_if(chart.diagnostics.begin(), chart.diagnostics.end(),
                                    [](const Diagnostic& d) { return d.severity == Severity::kError; });
    return tl::unexpected(error != chart.diagnostics.end() ? *error : Diagnostic{});
  }
  ChartEditor editor(*chart.value);
  auto name = std::visit(editor, gesture);
  if (!name) return tl::unexpected(name.error());
  const auto text = editor.apply();
  if (!text) return tl::unexpected(text.error());
  GestureResult result{edits_between(xml, *text), *name};
  if (result.edits.empty()) return fail("design.nothing-to-do", "it is so already");
  end_lines_alike(xml, result.edits);
  return result;
}

}  // namespace sentree::design
