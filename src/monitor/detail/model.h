#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sentree/monitor/monitor.h"
#include "sentree/monitor/projection.h"
#include "sentree/monitor/reader.h"

namespace sentree::monitor {

/// The inside of `Model`; for this library's own files.
struct Model::Parts {
  Spec spec;
  std::vector<Verdict> decides;    ///< By state: what its entry decides.
  std::vector<bool> pending;       ///< By state: something is owed while it is active.
  std::optional<Model> test;       ///< See `Model::test`.
  bool forgets = false;            ///< No datum outlives an observation.
  bool forgoes_witnesses = false;  ///< See `without_witnesses`.
  bool listens_to_all = false;
  std::vector<std::string> descriptors;  ///< Event descriptors of the chart's transitions.
  Projection projection;                 ///< What it looks at.
  /// Computes the data of renamed events: event "rename<i>" in, <send> with the data out; and whether they come: event
  /// "when<i>" in, a <send> if so.
  std::optional<scxml::Chart> renaming;
  std::vector<std::optional<std::size_t>> last_of;  ///< By rename: its place in `Core::last`, if its event looks back.
  std::size_t lasts = 0;
  /// By observation: the only ones whose it is about. Of names that are not here it is about everybody's.
  std::map<std::string, std::vector<std::string>, std::less<>> only_of;
  // Data, by slot, that every observation overwrites before anything reads them: of the chart, and of `renaming`.
  std::vector<bool> overwritten;
  std::vector<bool> renamed;
  /// Steps that need little, and what they read.
  struct Plain {
    scxml::PlainPlan plan;
    Reader reader;
  };
  std::map<std::string, Plain, std::less<>> plain;  ///< By observation, of those that the chart names in full.
};

/// Members that a plain step may read when it stands alone.
inline constexpr std::size_t kPlainMembersMax = 16;

struct Access {
  static const Model::Parts& parts(const Model& model) { return *model.parts_; }
  static void exchange(Model& model, Model::Parts parts) {
    model.parts_ = std::make_shared<const Model::Parts>(std::move(parts));
  }
};

/// Whether `name` fits one of the patterns.
[[nodiscard]] bool is_one_of(std::string_view name, const std::vector<std::string>& patterns);

/// Where a step leaves its trail; null: nowhere.
struct Tracing {
  Trail* trail = nullptr;
  Observation during = {};  ///< Null: no observation.
};

/// What several monitors need of one observation, made when the first of them needs it.
class Shared {
 public:
  /// @param projection  What any of them looks at. Both are borrowed.
  Shared(const Message& message, const Projection& projection) : message_(message), projection_(projection) {}
  [[nodiscard]] const scxml::Event& event() {
    if (!event_) {
      event_.emplace().name = message_.name;
      event_->data = projection_.data(message_);
    }
    return *event_;
  }

 private:
  const Message& message_;
  const Projection& projection_;
  std::optional<scxml::Event> event_;
};

/// How a step may be taken as a plain one.
struct PlainWay {
  const scxml::PlainPlan* plan = nullptr;  ///< Null: it may not.
  const scxml::PlainValue* members = nullptr;
  bool taken = false;  ///< It was.
  [[nodiscard]] bool kept_timers() const { return taken && plan->keeps_timers(); }
};

// As the public ones, with a trail, and with what is shared (null: nothing). They know no decided monitor.
[[nodiscard]] Core begin(const Model& model, TimePoint now, const Tracing& tracing, scxml::ExecutionWatch* watch);
Stepped step(const Model& model, Core& core, const Message& message, Shared* shared, PlainWay& plainly,
             const Tracing& tracing, scxml::ExecutionWatch* watch);
/// The same for whoever shares nothing.
Stepped step_alone(const Model& model, Core& core, const Message& message, const Tracing& tracing,
                   scxml::ExecutionWatch* watch);
Stepped step_timers(const Model& model, Core& core, TimePoint until, const Tracing& tracing,
                    scxml::ExecutionWatch* watch);
Decisions observe(const Model& model, State& state, const Observation& observation, Shared* shared, PlainWay& plainly,
                  scxml::ExecutionWatch* watch);

/// Gives up a monitor whose timers ring too often (`MonitorSet::kRungMax`): it could not keep up with a run.
/// @param due  When the last one rang.
void give_up_ringing(const Model& model, Core& core, TimePoint due);

/// Gives `decision` its witness: the smallest part of the history (one-minimal) after which it comes again.
void find_witness(const Model& model, const Trail& trail, Decision& decision, scxml::ExecutionWatch* watch);
/// Keeps of the history only what leads to the present session, as far as that can be found quickly.
void reduce_history(const Model& model, State& state, scxml::ExecutionWatch* watch);

}  // namespace sentree::monitor
