#include "sentree/project/plan.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <deque>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "sentree/base/told_once.h"
#include "sentree/bt/model.h"
#include "sentree/idl/conform.h"
#include "sentree/project/any_reply.h"
#include "sentree/project/chart_memory.h"
#include "sentree/project/check_intervention.h"
#include "sentree/project/detail/check_mission.h"
#include "sentree/project/detail/check_model.h"
#include "sentree/project/detail/check_monitor.h"
#include "sentree/project/detail/check_processes.h"
#include "sentree/project/detail/check_reactive.h"
#include "sentree/project/detail/check_skills.h"
#include "sentree/project/detail/check_topics.h"
#include "sentree/project/detail/check_verify.h"
#include "sentree/project/detail/checks.h"
#include "sentree/project/detail/part_cache.h"
#include "sentree/project/detail/skill_protocol.h"
#include "sentree/project/interface_file.h"
#include "sentree/project/mission_tree.h"
#include "sentree/project/requirements.h"
#include "sentree/rpc/address.h"
#include "sentree/rpc/middleware.h"
#include "sentree/scxml/check.h"
#include "sentree/sim/services.h"
#include "sentree/sim/topics.h"
#include "sentree/text/file.h"
#include "sentree/text/read_fence.h"

namespace sentree::project {

bool ServicePlan::is_idempotent(const idl::Method& method) const {
  return method.idempotent || std::find(idempotent.begin(), idempotent.end(), method.name) != idempotent.end();
}

bool ServicePlan::uses_other_middleware() const {
  const auto address = rpc::Address::parse(at);
  return address && address->kind == rpc::Address::Kind::kOther;
}

using std::filesystem::path;

namespace {

void append(Diagnostics& to, const Diagnostics& from) { to.insert(to.end(), from.begin(), from.end()); }

class Preparation {
 public:
  Preparation(const Project& project, PartCache& known)
      : project_(project), fence_(project.folder, {shipped_folder("interfaces")}), known_(known.impl()) {}

  void services() {
    for (const ServiceEntry& entry : project_.services) {
      if (!entry.observed.empty())
        check_address(fmt::format("what is observed as \"{}\"", entry.name), entry.observed, entry.span);
      else if (!is_inside(entry.at) && entry.at != kAnyReply)
        check_address(fmt::format("service \"{}\"", entry.name), entry.at, entry.span);
      if (const std::string way = missing_form(project_.folder / "interfaces", entry.idl, entry.interface);
          !entry.idl.empty() && !way.empty() && !find_interface(project_.folder / "interfaces", entry.idl)) {
        add("check.no-interface",
            fmt::format("service \"{}\": there is no interface \"{}/{}\"{}", entry.name, entry.idl, entry.interface,
                        way),
            entry.span);
        continue;
      }
      const idl::Schema* schema = interface(entry.idl, entry.span);
      if (schema == nullptr) continue;
      const auto service = idl::find_service(*schema, entry.interface, entry.span);
      if (!service) {
        diagnostics.push_back(service.error());
        continue;
      }
      services_[entry.name] = {entry.name,  *service,         entry.interface, entry.at,
                               entry.robot, entry.idempotent, entry.observed};
      if (!entry.observed.empty()) {
        check_observed(entry, **service);
        continue;
      }
      check_at(entry, **service);
      check_idempotent(entry, **service);
      if (entry.at == "topics") check_all_oneway(entry, **service, diagnostics);
      check_published(entry, **service, diagnostics);
      if (const auto* info = sim::find_service(entry.interface); info != nullptr && info->is_test_control) {
        add("check.test-control",
            fmt::format("\"{}\" is test control; skills must not reach it, and scenarios do so by the name \"{}\"",
                        entry.interface, kTestControl),
            entry.span);
      }
      if (entry.at == "sim" && sim::find_service(entry.interface) == nullptr && entry.interface != sim::kTelemetry) {
        add("check.not-simulated",
            fmt::format(
                "the simulator does not serve \"{0}\"; give the service an address (at: tcp://…), or a chart that "
                "answers for it (at: model, and models: [{{file: models/{1}.scxml, name: {1}_model, serves: [{1}]}}])",
                entry.interface, entry.name),
            entry.span);
      }
    }
  }

  // After the leaves: what their skills call must be answered.
  void models() {
    std::map<std::string, std::string> served;  // and by which model
    std::optional<monitor::Vocabulary> called;
    auto context = ChartMemory::kNoContext;
    std::vector<std::string> names;
    for (const ServiceEntry& entry : project_.services) names.push_back(entry.name);
    for (const ModelEntry& entry : project_.models) {
      std::vector<std::string> serves;
      bool are_known = true;
      for (const std::string& name : entry.serves) {
        const ServiceEntry* service = project_.service(name);
        are_known = are_known && service != nullptr;
        if (service == nullptr) {
          add("check.unknown-service",
              fmt::format("model \"{}\" serves \"{}\", which is no service of the project{}", entry.name, name,
                          did_you_mean(name, names)),
              entry.serves_span);
        } else if (const auto other = served.emplace(name, entry.name); !other.second) {
          add("check.model",
              other.first->second == entry.name ? fmt::format("model \"{}\" serves \"{}\" twice", entry.name, name)
                                                : fmt::format("service \"{}\" is served by two models, {} and {}", name,
                                                              other.first->second, entry.name),
              entry.serves_span);
        } else if (service->at == "model") {
          serves.push_back(name);
        }
      }
      const auto chart = load_chart(entry.file);
      if (!chart) continue;
      model_charts_.emplace_back(entry.name, *chart);
      // Of what it does not serve by mistake nothing more need be said.
      if (are_known) {
        check_model(entry, *chart, services_, leaves_, diagnostics);
        if (services_.size() == project_.services.size()) {
          if (!called) {
            called = vocabulary_of(services_, nullptr, leaves_, world_.get(), known_.findings);
            context = known_.findings.context(*called, services_);
          }
          known_.findings.add_findings(
              *chart, entry, context,
              [&](Diagnostics& found) {
                check_model_expressions(entry, known_.findings.facts(*chart), services_, *called, found);
              },
              diagnostics);
        }
      }
      check_subscriptions(fmt::format("model \"{}\"", entry.name), entry.subscribes, *chart, services_, diagnostics);
      if (!serves.empty() || entry.serves.empty())
        models_.push_back({entry.name, entry.file.path, *chart, std::move(serves), entry.subscribes.topics});
    }
    check_publishers(project_, leaves_, models_, services_, diagnostics);
    check_types(project_, services_, diagnostics);
    for (const ServiceEntry& entry : project_.services) {
      if (entry.at != "model" || served.contains(entry.name)) continue;
      add("check.model",
          fmt::format("service \"{}\" is at: model, but no entry of \"models\" serves it; write models: [{{file: {}, "
                      "serves: [{}]}}]",
                      entry.name, unlisted_model(), entry.name),
          entry.span);
    }
  }

  // A chart in models/ that no entry names, for messages.
  std::string unlisted_model() const {
    std::vector<std::string> charts;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(project_.folder / "models", error)) {
      const std::string name = "models/" + entry.path().filename().string();
      const auto is_it = [&](const ModelEntry& model) { return path(model.file.path).lexically_normal() == name; };
      if (entry.path().extension() == ".scxml" && std::none_of(project_.models.begin(), project_.models.end(), is_it))
        charts.push_back(name);
    }
    return charts.size() == 1 ? charts.front() : "models/X.scxml";
  }

  // With the map that is known, where its files are the same.
  Loaded<sim::World> load_world() {
    const auto source = known_.world_source(project_);
    if (!source) return {.value = std::nullopt, .diagnostics = {source.error()}};
    auto& map = known_.map;
    const bool is_known = known_.world && !map.empty() &&
                          map.front().file == (*source)->map_file(project_.world_overrides) &&
                          PartCache::Impl::are_same(map);
    if (is_known) return (*source)->with(project_.world_overrides, known_.world.get());
    map.clear();
    known_.world.reset();
    return (*source)->with(project_.world_overrides, nullptr,
                           [&](const path& file, const std::string& name, const std::string& content) {
                             map.push_back({file, name, content});
                           });
  }

  void world() {
    if (!project_.world) {
      const auto simulated =
          std::find_if(project_.services.begin(), project_.services.end(), [](const auto& s) { return s.at == "sim"; });
      if (simulated != project_.services.end()) {
        add("check.no-world",
            fmt::format("service \"{}\" is at: sim, but the project has no world: FILE", simulated->name),
            simulated->span);
      }
      if (project_.world_overrides)
        add("check.no-world", "override: {world: …} changes a world, and the project has none (world: FILE)",
            project_.world_overrides->span);
      return;
    }
    auto loaded = load_world();
    append(diagnostics, loaded.diagnostics);
    if (loaded.value) {
      world_ = std::make_shared<const sim::World>(std::move(*loaded.value));
      if (known_.world || loaded.diagnostics.empty()) known_.world = world_;
      for (const ServiceEntry& entry : project_.services) check_robot(entry);
    }
    if (const idl::Schema* schema = interface("robot.thrift", project_.world->span))
      test_control_ = schema->service("Simulation");
  }

  std::optional<bt::Tree> tree() {
    bt::Registry registry;
    auto loaded =
        load_mission(project_, registry, project_.executed_by.empty() ? TreePurpose::kRun : TreePurpose::kLook);
    append(diagnostics, loaded.diagnostics);
    if (!loaded.value) return std::nullopt;
    std::vector<FileRef> files = project_.mission_files;
    if (files.empty()) files.push_back(project_.mission);
    std::vector<MissionSource> sources;
    for (const FileRef& file : files) {
      const std::string shown = project_.shown(file.path);
      if (auto source = text::read_file(project_.folder / file.path, shown))
        sources.push_back({std::move(*source), shown});
    }
    check_mission(*loaded.value, sources, diagnostics);
    return std::move(loaded.value);
  }

  void leaves(const bt::Tree& tree) {
    for (const SkillEntry& entry : project_.skills) {
      if (!entry.at.empty()) check_address(fmt::format("skill \"{}\"", entry.leaf), entry.at, entry.span);
    }
    for (const bt::NodeId node : tree.external_leaves()) {
      const std::string id(tree.registration(node));
      const SkillEntry* entry = project_.skill(tree.name(node), id);
      FileRef file = skill_file(project_, entry, id);
      if (file.span.line == 0) file.span = tree.span(node);  // nobody else names it
      std::error_code error;
      const bool is_foreign =
          !project_.executed_by.empty() || (entry != nullptr && !entry->at.empty() && entry->file.path.empty() &&
                                            !std::filesystem::exists(project_.folder / file.path, error));
      const auto chart = is_foreign ? std::nullopt : skill_chart(file, entry);
      if (!chart && !is_foreign) continue;
      LeafPlan leaf{.node = node,
                    .name = tree.event_name(node),
                    .id = id,
                    .condition = tree.category(node) == bt::Category::kCondition,
                    .chart = chart,
                    .at = entry != nullptr ? entry->at : "",
                    .constants = constants_of(entry),
                    .protocol = protocol_of(entry),
                    .subscribes = subscribed(entry, file, chart),
                    .latest = entry != nullptr ? entry->subscribes.latest : std::vector<std::string>()};
      // A palette's ports are those of every robot; its charts use what theirs has.
      if (!path(file.path).is_absolute()) check_leaf_ports(tree, leaf, diagnostics);
      leaves_.push_back(std::move(leaf));
    }
    check_names(tree, leaves_, services_, project_, diagnostics);
    vocabulary_ = vocabulary_of(services_, &tree, leaves_, world_.get(), known_.findings);
    check_skills(tree, leaves_, services_, *vocabulary_, project_, known_.findings, diagnostics);
    check_reactive(tree, leaves_, diagnostics);
    if (world_) {
      check_tolerances(leaves_, *world_, diagnostics);
      check_locations(tree, leaves_, *world_, project_.shown(project_.world->path), diagnostics);
    }
    tell_elements_once(tree);
  }

  // What is found in a leaf of a BehaviorTree is found in each SubTree that has it; told of the first.
  void tell_elements_once(const bt::Tree& tree) {
    std::map<std::string, std::vector<std::string>> names;  // of the leaves, by the place of their element
    for (const LeafPlan& leaf : leaves_) names[to_string(tree.span(leaf.node))].push_back(leaf.name);
    std::set<std::string> told;
    std::erase_if(diagnostics, [&](const Diagnostic& found) {
      const auto here = names.find(to_string(found.span));
      if (here == names.end() || here->second.size() < 2) return false;
      std::string said = found.message;
      for (const std::string& name : here->second) {
        const std::size_t at = said.find(name);
        if (at != std::string::npos) said.replace(at, name.size(), "*");
      }
      return !told.insert(fmt::format("{} {} {}", here->first, found.code, said)).second;
    });
  }

  // A chart is loaded once, however many leaves run it.
  std::optional<scxml::Chart> skill_chart(const FileRef& file, const SkillEntry* entry) {
    const SkillProtocol* protocol = entry != nullptr && entry->protocol ? &*entry->protocol : nullptr;
    const bool is_new = !charts_.contains(file.path);
    if (is_new) {
      scxml::CheckOptions options;
      if (protocol != nullptr) options.seen_outside = {protocol->answer, protocol->halted};
      charts_[file.path] = load_chart(file, options);
    }
    const std::optional<scxml::Chart>& chart = charts_[file.path];
    if (!chart) return chart;
    if (is_new) check_skill_chart(*chart, services_, topics_of(file, *chart), project_, diagnostics);
    // Skills may share a protocol too.
    const SourceSpan way = protocol != nullptr ? protocol->places.at("") : SourceSpan{};
    if (ways_checked_.insert({file.path, to_string(way)}).second) {
      if (protocol != nullptr)
        check_protocol(*protocol, *chart, diagnostics);
      else
        check_outcomes(*chart, diagnostics);
    }
    if (entry != nullptr && entries_checked_.insert(entry).second) {
      check_skill_data(entry->data, *chart, diagnostics);
      check_subscriptions(fmt::format("skill \"{}\"", entry->leaf), entry->subscribes, *chart, services_, diagnostics);
      if (!entry->at.empty() && !entry->subscribes.topics.empty()) {
        add("check.subscribe",
            fmt::format(
                "skill \"{}\" runs in another process, which topics do not reach; leave \"at\" out, or \"subscribe\"",
                entry->leaf),
            entry->subscribes.span);
      }
    }
    return chart;
  }

  // That any skill with this chart subscribes to.
  std::set<std::string> topics_of(const FileRef& file, const scxml::Chart& chart) const {
    const std::vector<std::string> heard = subscribed(nullptr, file, chart);
    std::set<std::string> topics(heard.begin(), heard.end());
    for (const SkillEntry& entry : project_.skills) {
      if (skill_file(project_, &entry, entry.leaf).path == file.path)
        topics.insert(entry.subscribes.topics.begin(), entry.subscribes.topics.end());
    }
    return topics;
  }

  // A palette's chart that sends goals to actions hears how they end, without a word in sentree.yaml.
  std::vector<std::string> subscribed(const SkillEntry* entry, const FileRef& file,
                                      const std::optional<scxml::Chart>& chart) const {
    if (entry != nullptr && !entry->subscribes.topics.empty()) return entry->subscribes.topics;
    if (!chart || !file.path.ends_with(kActionChart)) return {};
    return topics_handled(*chart, services_);
  }

  static std::vector<SkillConstant> constants_of(const SkillEntry* entry) {
    return entry != nullptr ? entry->data : std::vector<SkillConstant>();
  }
  static std::optional<SkillProtocol> protocol_of(const SkillEntry* entry) {
    return entry != nullptr ? entry->protocol : std::nullopt;
  }

  [[nodiscard]] std::vector<std::string> model_names() const {
    std::vector<std::string> names;
    for (const ModelEntry& model : project_.models) names.push_back(model.name);
    return names;
  }

  void monitors(const bt::Tree* tree) {
    // What a broken project lacks has been said, and is not missed again by each monitor.
    const bool is_known =
        tree != nullptr && leaves_.size() == tree->external_leaves().size() && !has_errors(diagnostics);
    auto context = ChartMemory::kNoContext;
    if (is_known) {
      add_models(model_names(), model_charts_, known_.findings, *vocabulary_);
      context = known_.findings.context(*vocabulary_, services_);
    }
    const monitor::Vocabulary* known = observed_ = is_known ? &*vocabulary_ : nullptr;
    for (const ObserverEntry& entry : project_.observers) {
      check_address(fmt::format("observer \"{}\"", entry.name), entry.at, entry.span);
      observers_.push_back({.name = entry.name, .at = entry.at, .is_monitor = false});
    }
    for (const MonitorEntry& entry : project_.monitors) {
      if (!entry.at.empty()) {
        check_address(fmt::format("monitor \"{}\"", entry.name), entry.at, entry.span);
        observers_.push_back({.name = entry.name, .at = entry.at, .is_monitor = true});
        continue;
      }
      auto model = is_requirement(entry) ? synthesized(entry, known, context) : drawn(entry, known, context);
      if (!model) continue;
      if (!entry.gate.empty()) {
        check_gate(entry, *model, services_, diagnostics);
        gates_.push_back({monitors_.size(), entry.gate});
      }
      monitors_.push_back(std::move(*model));
    }
  }

  static bool is_requirement(const MonitorEntry& entry) { return path(entry.file.path).extension() == ".req"; }

  std::optional<monitor::Model> drawn(const MonitorEntry& entry, const monitor::Vocabulary* vocabulary,
                                      ChartMemory::ContextId context) {
    const auto chart = load_chart(entry.file);
    if (!chart) return std::nullopt;
    known_.findings.add_findings(
        *chart, entry, context,
        [&](Diagnostics& found) { check_monitor(entry, known_.findings.facts(*chart), vocabulary, found); },
        diagnostics);
    monitor::Spec spec{.name = entry.name, .chart = *chart, .violated = entry.violated, .span = entry.span};
    for (const EventRename& rename : entry.events) {
      check_sources(rename, leaves_, services_, project_, vocabulary, diagnostics);
      spec.renames.push_back({rename.event, rename.on, rename.from, rename.data, rename.when, rename.span});
    }
    auto model = monitor::Model::make(std::move(spec));
    append(diagnostics, model.diagnostics);
    return std::move(model.value);
  }

  // One requirement of a file, which is read once.
  std::optional<monitor::Model> synthesized(const MonitorEntry& entry, const monitor::Vocabulary* vocabulary,
                                            ChartMemory::ContextId context) {
    const std::string shown = project_.shown(entry.file.path);
    if (!requirements_.contains(entry.file.path)) {
      auto& slot = requirements_[entry.file.path];
      const path full = project_.folder / entry.file.path;
      auto source = text::read_file(full, shown, monitor::kRequirementBytesMax);
      if (!source) {
        diagnostics.push_back(missing(project_, entry.file, source.error()));
        return std::nullopt;
      }
      slot = known_.requirements_of({full, shown, std::move(*source)});
      append(diagnostics, slot->parsed.diagnostics);
      if (slot->parsed.value) monitor::check_definitions(*slot->parsed.value, vocabulary, diagnostics);
    }
    const std::shared_ptr<PartCache::Impl::Requirements> known = requirements_[entry.file.path];
    if (known == nullptr || !known->parsed.value) return std::nullopt;
    const monitor::RequirementFile* const file = &*known->parsed.value;
    if (!entry.violated.empty() || !entry.events.empty())
      add("check.requirement", "a requirement needs neither \"violated\" nor \"events\"", entry.span);
    for (monitor::Requirement requirement : file->requirements) {
      if (requirement.name != entry.requirement) continue;
      requirement.name = entry.name;
      if (known->monitors.size() >= PartCache::Impl::kSynthesizedMax) known->monitors.clear();
      const auto [model, is_new] = known->monitors.try_emplace({entry.requirement, entry.name, context});
      if (is_new) model->second = monitor::Model::make(requirement, vocabulary);
      append(diagnostics, model->second.diagnostics);
      return model->second.value;
    }
    add("check.requirement", fmt::format("\"{}\" holds no requirement, only definitions", entry.file.path),
        entry.file.span);
    return std::nullopt;
  }

  void add(std::string code, std::string message, SourceSpan span) {
    diagnostics.push_back({Severity::kError, std::move(code), std::move(message), std::move(span)});
  }

  Diagnostics diagnostics;
  std::map<std::string, ServicePlan> services_;
  std::vector<std::pair<rpc::Address, SourceSpan>> addresses_;  // of middlewares beside Thrift
  std::vector<LeafPlan> leaves_;
  std::vector<ModelPlan> models_;
  ModelCharts model_charts_;
  std::vector<monitor::Model> monitors_;
  std::vector<GatePlan> gates_;
  std::vector<ObserverPlan> observers_;
  std::shared_ptr<const sim::World> world_;
  idl::ServicePtr test_control_;
  const monitor::Vocabulary* observed_ = nullptr;  // null: not all of it is known

 private:
  void check_address(const std::string& what, const std::string& at, const SourceSpan& span) {
    // "{name}" is the address of a process that the scenario starts.
    if (at.starts_with('{')) return;
    auto address = rpc::Address::parse(at);
    if (!address) {
      static const std::vector<std::string> kInside{"sim", "model", "topics"};
      const std::string near = at.find(':') == std::string::npos ? did_you_mean(at, kInside) : "";
      return add(address.error().code, fmt::format("{}: {}{}", what, address.error().message, near), span);
    }
    if (address->kind != rpc::Address::Kind::kOther) return;
    const rpc::Middleware& middleware = rpc::middleware_of(*address);
    for (const auto& [other, place] : addresses_) {
      if (other.scheme != address->scheme) continue;
      const auto fits = middleware.check_beside(*address, other);
      if (fits) continue;
      add(fits.error().code, fmt::format("{}: {} (the other one: {})", what, fits.error().message, to_string(place)),
          span);
      break;
    }
    addresses_.emplace_back(std::move(*address), span);
  }

  void check_robot(const ServiceEntry& entry) {
    if (world_->robot(entry.robot)) return;
    std::vector<std::string> names;
    for (const sim::RobotSpec& robot : world_->robots) names.push_back(robot.name);
    add("check.unknown-robot",
        fmt::format("service \"{}\" is of robot \"{}\", which the world does not have{}", entry.name, entry.robot,
                    did_you_mean(entry.robot, names)),
        entry.span);
  }

  void check_observed(const ServiceEntry& entry, const idl::Service& service) {
    if (entry.at != "topics") {
      add("check.observed",
          fmt::format("\"{}\" is observed and nothing that is called, so it cannot be at: {}; what others say there is "
                      "heard in real time only",
                      entry.name, entry.at),
          entry.span);
    }
    const auto address = rpc::Address::parse(entry.observed);
    if (!address) return;  // has been told
    if (auto heard = rpc::middleware_of(*address).check_overheard(*address, service); !heard) {
      heard.error().span = entry.span;
      heard.error().message = fmt::format("\"{}\" cannot be observed: {}", entry.name, heard.error().message);
      diagnostics.push_back(std::move(heard.error()));
    }
  }

  // What the address says beside the name, of what the interface is.
  void check_at(const ServiceEntry& entry, const idl::Service& service) {
    if (is_inside(entry.at)) return;
    const auto address = rpc::Address::parse(entry.at);
    if (!address) return;  // has been told
    if (const auto can_be = rpc::middleware_of(*address).check_service(*address, service); !can_be)
      add(can_be.error().code, fmt::format("service \"{}\": {}", entry.name, can_be.error().message), entry.span);
  }

  void check_idempotent(const ServiceEntry& entry, const idl::Service& service) {
    for (const std::string& method : entry.idempotent) {
      if (service.find(method) == nullptr) {
        add("check.unknown-method",
            fmt::format("service \"{}\" has no method \"{}\"{}", entry.name, method,
                        did_you_mean(method, service.method_names())),
            entry.idempotent_span);
      }
    }
  }

  const idl::Schema* interface(const std::string& name, const SourceSpan& span) {
    if (const auto known = schemas_.find(name); known != schemas_.end()) return known->second;
    const idl::Schema*& slot = schemas_[name];
    const path own = project_.folder / "interfaces";
    const auto file = find_interface(own, name);
    if (!file) {
      add("check.no-interface",
          fmt::format("interface file \"{}\" is neither in the project's interfaces/ nor among those of Sentree{}",
                      name, name.ends_with(".thrift") ? "" : ", nor in the share/ of a folder in $AMENT_PREFIX_PATH"),
          span);
      return nullptr;
    }
    const auto& loaded = known_.interface(*file, *file == own / name ? project_.shown("interfaces/" + name) : name);
    append(diagnostics, loaded.diagnostics);
    // The types of services are shared; the schema itself may be forgotten.
    if (loaded.value) slot = &kept_.emplace_back(*loaded.value);
    return slot;
  }

  std::optional<scxml::Chart> load_chart(const FileRef& file, const scxml::CheckOptions& checked = {}) {
    const std::string shown = project_.shown(file.path);
    const path full = project_.folder / file.path;
    const auto source = text::read_file(full, shown);
    if (!source) {
      diagnostics.push_back(missing(project_, file, source.error()));
      return std::nullopt;
    }
    const std::pair key{full.string(), checked.seen_outside};
    if (const auto* looked = known_.chart(key, *source)) {
      append(diagnostics, looked->found);
      return looked->chart;
    }
    scxml::LoadOptions options;
    std::vector<PartCache::Impl::Text> included;
    bool are_all_there = true;
    options.read = [&](std::string_view uri) {
      PartCache::Impl::Text part{
          full.parent_path() / std::string(uri), project_.shown((path(file.path).parent_path() / uri).string()), {}};
      auto content = text::read_file(part.file, part.shown);
      are_all_there = are_all_there && content.has_value();
      if (content) {
        part.content = *content;
        included.push_back(std::move(part));
      }
      return content;
    };
    auto loaded = scxml::load(*source, shown, options);
    if (loaded.value) append(loaded.diagnostics, scxml::check(*loaded.value, checked));
    append(diagnostics, loaded.diagnostics);
    if (are_all_there) {
      if (known_.charts.size() >= PartCache::Impl::kChartsMax) known_.charts.clear();
      known_.charts.insert_or_assign(
          key, PartCache::Impl::Looked{*source, std::move(included), loaded.value, std::move(loaded.diagnostics)});
    }
    return std::move(loaded.value);
  }

  const Project& project_;
  const text::ReadFence fence_;
  PartCache::Impl& known_;
  std::deque<idl::Schema> kept_;
  std::map<std::string, const idl::Schema*> schemas_;  // null: it could not be read
  std::optional<monitor::Vocabulary> vocabulary_;
  std::map<std::string, std::optional<scxml::Chart>> charts_;
  std::set<std::pair<std::string, std::string>> ways_checked_;  // of charts: to answer ticks
  std::set<const SkillEntry*> entries_checked_;
  std::map<std::string, std::shared_ptr<PartCache::Impl::Requirements>> requirements_;  // null: it could not be read
};

}  // namespace

std::vector<std::string> test_control_names(const sim::World& world) {
  std::vector<std::string> names{std::string(kTestControl)};
  if (world.robots.size() < 2) return names;
  for (const sim::RobotSpec& robot : world.robots) names.push_back(fmt::format("{}/{}", robot.name, kTestControl));
  return names;
}

std::optional<std::string> test_control_of(std::string_view name, const sim::World& world) {
  if (name == kTestControl) return std::string();
  for (const sim::RobotSpec& robot : world.robots) {
    if (world.robots.size() > 1 && name == fmt::format("{}/{}", robot.name, kTestControl)) return robot.name;
  }
  return std::nullopt;
}

std::filesystem::path shipped_folder(std::string_view what) {
  std::error_code error;
  const path program = std::filesystem::read_symlink("/proc/self/exe", error);
  std::vector<path> shares{program.parent_path() / "../share"};
  // A program of somebody else's that is linked with the library lies anywhere.
  const char* set = std::getenv("XDG_DATA_DIRS");
  std::string_view left = set != nullptr && *set != '\0' ? set : "/usr/local/share:/usr/share";
  while (!left.empty()) {
    const std::size_t end = std::min(left.find(':'), left.size());
    if (left.starts_with('/')) shares.emplace_back(left.substr(0, end));
    left.remove_prefix(std::min(end + 1, left.size()));
  }
  for (const path& share : shares) {
    const path candidate = share / "sentree" / what;
    if (std::filesystem::is_directory(candidate, error)) return candidate.lexically_normal();
  }
  return {};
}

bool load_plugins(const Project& project, bt::Registry& registry, Diagnostics& diagnostics) {
  bool all = true;
  for (const FileRef& plugin : project.plugins) {
    const path file = project.folder / plugin.path;
    // For the recording of a run, which keeps what its project consists of.
    (void)text::read_file(file);
    auto loaded = registry.plugin(file);
    if (loaded) continue;
    all = false;
    loaded.error().span = plugin.span;
    diagnostics.push_back(std::move(loaded.error()));
  }
  return all;
}

namespace {

std::uint64_t identity_of(const Scenario& scenario, std::set<std::uint64_t> contents) {
  contents.insert(scenario.project.contents.begin(), scenario.project.contents.end());
  std::uint64_t identity = hash_combine(scenario.seed, std::bit_cast<std::uint64_t>(scenario.factor));
  for (const std::uint64_t content : contents) identity = hash_combine(identity, content);
  return identity;
}

}  // namespace

Loaded<Plan> prepare(Scenario scenario, PartCache& known) {
  Loaded<Plan> prepared;
  const text::ReadHashes read;
  Preparation preparation(scenario.project, known);
  preparation.services();
  preparation.world();
  auto tree = preparation.tree();
  if (tree) preparation.leaves(*tree);
  preparation.models();
  preparation.monitors(tree ? &*tree : nullptr);
  check_processes(scenario, preparation.diagnostics);
  const InterventionScope scope{.scenario = &scenario,
                                .tree = tree ? &*tree : nullptr,
                                .leaves = tree ? &preparation.leaves_ : nullptr,
                                .services = &preparation.services_,
                                .test_control = preparation.test_control_,
                                .world = preparation.world_.get(),
                                .monitors = tree ? &preparation.monitors_ : nullptr,
                                .vocabulary = preparation.observed_};
  for (const Injection& injection : scenario.timeline) {
    if (auto checked = check_intervention(injection.what, scope, injection.span); !checked)
      preparation.diagnostics.push_back(checked.error());
    else if (auto doubt = doubt_about(injection.what, scope, injection.span))
      preparation.diagnostics.push_back(std::move(*doubt));
    else if (auto number = doubt_about_number(scenario, injection))
      preparation.diagnostics.push_back(std::move(*number));
  }
  for (const DelayFault& delay : scenario.delays) {
    const intervention::Delay what{.message = delay.message, .by = delay.by};
    if (auto checked = check_intervention(what, scope, delay.span); !checked)
      preparation.diagnostics.push_back(checked.error());
  }
  // What models serve, `sentree verify` lets them serve, wherever it is in a run.
  std::map<std::string, ServicePlan> modelled = preparation.services_;
  for (const ModelEntry& model : scenario.project.models) {
    for (const std::string& name : model.serves) {
      if (const auto service = modelled.find(name); service != modelled.end()) service->second.at = "model";
    }
  }
  InterventionScope explored = scope;
  explored.services = &modelled;
  // It is explored in one process; what is said of one that runs in several would be wrong.
  if (scenario.processes.empty()) check_verify(scenario, explored, preparation.model_charts_, preparation.diagnostics);
  if (auto unrolled = unroll(scenario); !unrolled) preparation.diagnostics.push_back(unrolled.error());
  if (tree) check_process_skills(scenario, *tree, preparation.leaves_, preparation.diagnostics);
  sort_by_place(preparation.diagnostics);
  prepared.diagnostics = std::move(preparation.diagnostics);
  if (has_errors(prepared.diagnostics) || !tree) return prepared;
  prepared.value = Plan{.scenario = std::move(scenario),
                        .tree = std::move(*tree),
                        .leaves = std::move(preparation.leaves_),
                        .services = std::move(preparation.services_),
                        .models = std::move(preparation.models_),
                        .test_control = std::move(preparation.test_control_),
                        .monitors = std::move(preparation.monitors_),
                        .gates = std::move(preparation.gates_),
                        .observers = std::move(preparation.observers_),
                        .world = std::move(preparation.world_),
                        .warnings = prepared.diagnostics};
  prepared.value->identity = identity_of(prepared.value->scenario, read.hashes());
  return prepared;
}

Loaded<Plan> prepare(Scenario scenario) {
  PartCache cache;
  return prepare(std::move(scenario), cache);
}

Diagnostics check_project(const path& folder_or_file) {
  PartCache cache;
  return check_project(folder_or_file, cache);
}

Diagnostics check_project(const path& folder_or_file, PartCache& cache) {
  return check_project(load_project(folder_or_file), cache);
}

Diagnostics check_project(const Loaded<Project>& project, PartCache& cache) {
  Diagnostics all;
  // The same finding may be reached through the project and through each of its scenarios.
  ToldOnce told;
  const auto add_new = [&](const Diagnostics& found) { told.append(found, all); };
  add_new(project.diagnostics);
  if (!project.ok()) return all;
  const auto files = scenario_files(*project.value);
  add_new(prepare(plain_scenario(*project.value), cache).diagnostics);
  for (const path& file : files) {
    auto scenario = load_scenario(file, &*project.value);
    add_new(scenario.diagnostics);
    if (!scenario.ok()) continue;
    add_new(prepare(std::move(*scenario.value), cache).diagnostics);
  }
  return all;
}

Loaded<monitor::Vocabulary> load_vocabulary(const Project& project) {
  Loaded<monitor::Vocabulary> loaded;
  PartCache known;
  Preparation preparation(project, known);
  preparation.services();
  if (project.world) preparation.world();
  const auto tree = preparation.tree();
  if (tree) preparation.leaves(*tree);
  loaded.diagnostics = std::move(preparation.diagnostics);
  if (tree && !has_errors(loaded.diagnostics)) {
    loaded.value = vocabulary_of(preparation.services_, &*tree, preparation.leaves_, preparation.world_.get(),
                                 known.impl().findings);
    preparation.models();  // what is wrong with them is not asked for
    add_models(preparation.model_names(), preparation.model_charts_, known.impl().findings, *loaded.value);
  }
  return loaded;
}

namespace {

// What the tree says of the leaf's inputs, beside what is known already of others of its ID.
void add_inputs(const bt::Tree& tree, bt::NodeId leaf, bool is_first, SkillPlan& plan) {
  const bt::Model& model = tree.model();
  const bt::Node& node = model.nodes[leaf];
  const bt::Manifest& manifest = model.manifest(leaf);
  Map given;
  std::vector<std::string> ports;
  for (std::uint32_t i = node.ports; i < node.ports + node.port_count; ++i) {
    const bt::Binding& port = model.bindings[i];
    if (port.declared != 0xFFFF && manifest.ports[port.declared].direction == bt::PortDirection::kOutput) continue;
    ports.push_back(model.strings[port.name]);
    if (port.kind == bt::Binding::Kind::kLiteral) given[ports.back()] = model.literals[port.target].value;
  }
  Map known = std::exchange(plan.inputs, {});
  for (const auto& [name, value] : given) {
    const Value* other = known.find(name);
    if (is_first || (other != nullptr && *other == value)) plan.inputs[name] = value;
  }
  for (const scxml::DataItem& item : plan.chart.data()) {
    const auto is_it = [&](const auto& name) { return name == item.id; };
    const bool is_constant = std::any_of(plan.constants.begin(), plan.constants.end(),
                                         [&](const SkillConstant& constant) { return constant.id == item.id; });
    if (item.has_value || is_constant || plan.inputs.find(item.id) != nullptr) continue;
    if (std::any_of(ports.begin(), ports.end(), is_it) && std::none_of(plan.without.begin(), plan.without.end(), is_it))
      plan.without.push_back(item.id);
  }
}

}  // namespace

Loaded<SkillPlan> prepare_skill(const Project& project, const std::string& leaf) {
  Loaded<SkillPlan> prepared;
  PartCache known;
  Preparation preparation(project, known);
  preparation.services();
  // The mission tells the leaf's ID, and whether it is a condition.
  const auto tree = preparation.tree();
  std::optional<SkillPlan> plan;
  if (tree) {
    std::vector<std::string> names;
    for (const bt::NodeId node : tree->external_leaves()) {
      const std::string id(tree->registration(node));
      names.push_back(tree->event_name(node));
      names.push_back(id);
      if (plan && id == leaf && plan->id == id) add_inputs(*tree, node, false, *plan);
      if (plan || (names.end()[-2] != leaf && id != leaf)) continue;
      const SkillEntry* entry = project.skill(leaf, id);
      const auto chart = preparation.skill_chart(skill_file(project, entry, id), entry);
      if (chart)
        plan = SkillPlan{.chart = *chart,
                         .services = {},
                         .condition = tree->category(node) == bt::Category::kCondition,
                         .id = id,
                         .deadlines = project.deadlines,
                         .constants = Preparation::constants_of(entry),
                         .protocol = Preparation::protocol_of(entry)};
      if (plan) add_inputs(*tree, node, true, *plan);
    }
    if (!plan && !has_errors(preparation.diagnostics)) {
      preparation.add("check.unknown-leaf",
                      fmt::format("the mission has no leaf named \"{}\"{}", leaf, did_you_mean(leaf, names)),
                      project.mission.span);
    }
  }
  sort_by_place(preparation.diagnostics);
  prepared.diagnostics = std::move(preparation.diagnostics);
  if (plan && !has_errors(prepared.diagnostics)) {
    plan->services = std::move(preparation.services_);
    prepared.value = std::move(plan);
  }
  return prepared;
}

Loaded<MonitorPlan> prepare_monitor(const Project& project, const std::string& name) {
  Loaded<MonitorPlan> prepared;
  Project alone = project;
  alone.observers.clear();
  std::vector<std::string> names;
  for (const MonitorEntry& entry : project.monitors) names.push_back(entry.name);
  std::erase_if(alone.monitors, [&](const MonitorEntry& entry) { return entry.name != name; });
  PartCache known;
  Preparation preparation(alone, known);
  if (alone.monitors.empty()) {
    preparation.add("check.unknown-monitor",
                    fmt::format("the project has no monitor \"{}\"{}", name, did_you_mean(name, names)),
                    SourceSpan{project.file});
  } else {
    alone.monitors.front().at.clear();
    preparation.services();
    const auto tree = preparation.tree();
    preparation.monitors(tree ? &*tree : nullptr);
  }
  prepared.diagnostics = std::move(preparation.diagnostics);
  if (has_errors(prepared.diagnostics)) return prepared;
  prepared.value = MonitorPlan{std::move(preparation.monitors_.front()), alone.monitors.front().gate};
  return prepared;
}

}  // namespace sentree::project
