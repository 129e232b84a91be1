#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "sentree/monitor/requirement_types.h"
#include "sentree/project/chart_facts.h"
#include "sentree/project/model_choices.h"
#include "sentree/project/plan.h"
#include "sentree/project/project.h"

namespace sentree::project {

/// How the leaves of a mission use one chart.
struct SkillUse {
  std::set<std::string> given = {};           ///< Names of its <data> that ports or sentree.yaml give values.
  std::set<std::string> texts = {};           ///< Those of them that are text: constants of ports that have no type.
  bool is_native = false;                     ///< Some leaf runs it without a protocol …
  bool is_condition = false;                  ///< … and that is a condition.
  std::vector<SkillProtocol> protocols = {};  ///< Of the others.
  std::set<std::string> topics = {};          ///< That it subscribes to.
  friend bool operator==(const SkillUse&, const SkillUse&) = default;
};

/// What has been found out about charts: while neither a chart nor what it is used for nor what the project observes
/// has changed, it need not be found again. Bounded; of one thread at a time.
class ChartMemory {
 public:
  /// Names what a project observes: its vocabulary and services.
  using ContextId = std::size_t;
  /// Of no context: it is not known what is observed.
  static constexpr ContextId kNoContext = static_cast<ContextId>(-1);

  [[nodiscard]] ChartFacts facts(const scxml::Chart& chart);
  /// Texts that its expressions and those of charts that it invokes write down, and what it can choose.
  struct Words {
    scxml::Chart chart;
    std::set<std::string> texts;
    KnownChoices choices;
  };
  [[nodiscard]] const Words& words(const scxml::Chart& chart);
  /// Cost: that of comparing it with the last ones. What was found beside the oldest one is forgotten now and then.
  [[nodiscard]] ContextId context(const monitor::Vocabulary& vocabulary,
                                  const std::map<std::string, ServicePlan>& services);

  /// Appends what `find(Diagnostics&)` finds, or found for an equal use beside that context.
  /// @param use  SkillUse, MonitorEntry or ModelEntry.
  template <class Use, class Find>
  void add_findings(const scxml::Chart& chart, const Use& use, ContextId context, const Find& find,
                    Diagnostics& diagnostics) {
    auto& known = std::get<Memory<Use>>(found_)[&chart.model()];
    auto entry = std::find_if(known.begin(), known.end(),
                              [&](const auto& one) { return one.context == context && one.use == use; });
    if (entry == known.end()) {
      if (known.size() >= kUsesMax) known.clear();
      ++finds_;
      known.push_back({chart, context, use, {}});
      entry = std::prev(known.end());
      find(entry->found);
    }
    for (const Diagnostic& one : entry->found) {
      if (std::find(diagnostics.begin(), diagnostics.end(), one) == diagnostics.end()) diagnostics.push_back(one);
    }
  }

 private:
  static constexpr std::size_t kChartsMax = 4096;
  static constexpr std::size_t kContextsMax = 64;
  static constexpr std::size_t kUsesMax = 64;

  struct Context {
    monitor::Vocabulary vocabulary;
    std::map<std::string, idl::ServicePtr> services;
  };

  // Each keeps the chart whose model it goes by, so that no other gets that place in memory.
  template <class Use>
  struct Found {
    scxml::Chart chart;
    ContextId context;
    Use use;
    Diagnostics found;
  };
  template <class Use>
  using Memory = std::map<const scxml::Model*, std::vector<Found<Use>>>;

  void forget();

  ContextId first_ = 0;    // of contexts_
  std::size_t finds_ = 0;  // since it forgot
  std::map<const scxml::Model*, ChartFacts> facts_;
  std::map<const scxml::Model*, Words> words_;
  std::vector<Context> contexts_;
  std::tuple<Memory<SkillUse>, Memory<MonitorEntry>, Memory<ModelEntry>> found_;
};

}  // namespace sentree::project
