#pragma once

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "sentree/design/findings.h"
#include "sentree/design/tree_edit.h"
#include "sentree/design/workspace.h"
#include "sentree/lsp/index.h"
#include "sentree/lsp/rename.h"
#include "sentree/project/part_cache.h"
#include "sentree/studio/detail/nothing.h"
#include "sentree/studio/detail/past.h"
#include "sentree/studio/detail/run_beside.h"
#include "sentree/studio/detail/shadow.h"
#include "sentree/studio/detail/simulations.h"
#include "sentree/studio/workshop.h"
#include "sentree/text/overlay.h"

namespace sentree::studio {

class AskedEdit;

/// Recordings of a project that are offered, the newest first, by name.
[[nodiscard]] std::vector<std::string> recordings_in(const std::filesystem::path& folder);

struct Workshop::Impl {
  Impl(design::Workspace opened, std::string program, std::function<std::string(const runtime::MonitorReport&)> tells)
      : workspace(std::move(opened)),
        folder(workspace.folder()),
        version(std::move(program)),
        story(std::move(tells)) {}
  ~Impl();

  Result<Value> carry_out(const std::string& op, const Value& request);
  Result<Value> edit_by_gesture(const AskedEdit& asked);
  Result<Value> add(const AskedEdit& asked);
  /// Of a place of the world, a tree, a node of one or a state of a chart, wherever it is named, in one step.
  Result<Value> rename(const AskedEdit& asked);
  Result<Value> rename(const lsp::Symbol& symbol, const std::string& name, const std::string& to);
  /// Of a file, with what names it, in one step.
  Result<Value> rename_file(const std::string& file, const std::string& to);
  Result<Value> tell_reverted(const Result<design::Workspace::Reverted>& reverted);
  /// @param keep  "theirs" or "ours".
  Result<Value> resolve(const std::string& file, std::string_view keep);
  Result<Value> begin_project();
  Result<Value> remove(const std::string& file);
  /// Who names a file, or goes with it.
  Result<Value> uses_of(const std::string& file);
  struct Renamed {
    std::vector<design::Workspace::NewText> texts;
    std::size_t occurrences = 0;
  };
  /// As pages are told it; of the texts of the index.
  [[nodiscard]] List unfollowed_by(const lsp::Symbol& symbol) const;
  [[nodiscard]] Result<Renamed> renamed_texts(const lsp::Renaming& renaming) const;
  /// What may stand at a byte of a text, or what is known of what stands there (null: nothing).
  Result<Value> help_with(const std::string& file, std::uint64_t byte, bool complete);
  [[nodiscard]] Value other_sides() const;
  [[nodiscard]] Result<Value> simulate(const std::string& op, const AskedEdit& asked, const Value& request);
  [[nodiscard]] Result<Value> compare(const std::string& op, const AskedEdit& asked);
  Result<Value> save(const AskedEdit& asked);
  void changed(const std::vector<std::string>& files);
  void saved_beside(const std::vector<std::string>& saved, std::vector<std::string>& files);
  [[nodiscard]] Value summary() const;
  void tell_summary() { server->tell(to_json(summary())); }
  void tell_document(const std::string& file);
  [[nodiscard]] bool is_saved() const {
    const auto& documents = workspace.documents();
    return std::none_of(documents.begin(), documents.end(), [](const auto& d) { return d.second.is_dirty(); });
  }

  Result<Value> reached(bool of_all);
  Result<Value> verified();

  // What pages are shown: the shadow run, a run that goes on beside it, or a recording.
  Result<Value> begin_run(double factor, bool real_time);
  Result<Value> apply_to_run();
  Result<Value> show_run(const std::string& recording);
  Result<Value> steer(const std::string& op, const Value& request);
  /// `again`: in place of the same scenario's with other texts.
  void show_shadow(bool again = false);
  void show_beside();
  [[nodiscard]] Value runs() const;
  void reach_all(std::uint64_t of_revision);

  void check_and_run();
  struct Texts {
    text::Overlay overlay;
    std::map<std::string, std::string> texts;
    std::string scenario;
    bool saved = false;
    std::uint64_t revision = 0;
  };
  [[nodiscard]] Texts texts_now() const;
  void learn(const Texts& texts, const project::Project& project);
  /// With what was found in the scenario.
  [[nodiscard]] Loaded<project::Plan> prepared(Loaded<project::Scenario> chosen);
  [[nodiscard]] Loaded<project::Scenario> chosen_scenario(const std::string& name,
                                                          const Loaded<project::Project>& project) const;
  [[nodiscard]] Map charts_of(const project::Project& project, const std::vector<bt::NodeModel>& skills,
                              const Texts& texts) const;
  [[nodiscard]] std::string as_read(std::string message) const;
  void keep_findings(const Texts& texts, const Diagnostics& found, bool whole);
  /// Files that are broken and that no part of a check has read: nothing names them, or what does is broken itself.
  void add_unread(const Texts& texts, Diagnostics& found) const;
  void judge_past(const Texts& texts, const project::Plan& plan);
  void run_shadow(project::Plan plan, bool as_baseline, bool and_show, std::uint64_t of_revision);

  void watch();
  void read_events(std::set<std::string>& paths);
  void add_watches(const std::filesystem::path& below);

  mutable std::mutex mutex;
  std::condition_variable news;
  design::Workspace workspace;
  const std::filesystem::path folder;
  design::Kinds kinds{{}};
  std::vector<bt::NodeModel> own;
  std::string palette;         // as pages are told it
  std::uint64_t palettes = 0;  // that there were; of the worker
  List places;                 // of the world, for completion
  List interfaces;             // of services, too
  Map charts;                  // by ID or name of leaves: files that the scenario has run
  std::set<std::string> open;  // files whose text some page has asked for
  std::vector<design::Finding> findings;
  std::string scenario;  // file; empty: the mission as it stands
  std::vector<std::string> scenarios;
  std::uint64_t revision = 1;              // of the texts
  std::uint64_t checked = 0;               // revision whose findings are known
  std::shared_ptr<const Shadow> baseline;  // as it goes with what is saved
  std::shared_ptr<const Shadow> shadow;    // as it goes with what is edited
  std::uint64_t shadow_of = 0;             // its revision
  std::string shadow_scenario;             // that it runs
  std::string shadow_problem;
  bool stopping = false;
  bool past_wanted = false;                        // requirements have been opened
  bool all_wanted = false;                         // somebody looks at what all scenarios reach
  std::shared_ptr<const campaign::Coverage> all;   // what they reach together
  std::uint64_t all_of = 0;                        // its revision
  std::atomic<bool> outdated = false;              // what the shadow runs is not the newest any more
  std::shared_ptr<RunBeside> beside;               // the last run that was begun here
  bool goes_on = false;                            // it does, or is about to
  std::string beside_scenario;                     // that it runs
  std::uint64_t beside_of = 0;                     // the revision whose texts it runs
  std::string on_show;                             // recording in runs/ that pages are shown; empty: the shadow run
  std::function<Result<Value>()> reached_on_show;  // by it

  const std::string version;  // of the program
  const std::function<std::string(const runtime::MonitorReport&)> story;

  const Nothing no_run;  // shown until there is something to run
  std::unique_ptr<Server> server;
  int inotify = -1;
  int wake = -1;
  std::map<int, std::string> watched;  // folder inside the project, by watch; of the watching thread
  Simulations simulations{folder};     // of the thread that steers
  lsp::Index index{folder};            // what the texts name
  project::PartCache parts;            // of the worker
  Past past{folder};                   // of the worker
  std::thread worker;
  std::thread watcher;
};

}  // namespace sentree::studio
