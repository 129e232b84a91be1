#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "sentree/base/lock_file.h"
#include "sentree/campaign/campaign.h"
#include "sentree/cli/campaign_command.h"
#include "sentree/cli/interrupts.h"
#include "sentree/cli/output.h"
#include "sentree/cli/share.h"
#include "sentree/project/scenario_text.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

namespace fs = std::filesystem;

// Runs where none are asked for, and where something may end the campaign before.
constexpr std::uint64_t kRuns = 1'000;
constexpr std::uint64_t kRunsOpen = 100'000;

fs::path folder_of(const std::string& project) {
  const fs::path path(project);
  std::error_code error;
  return fs::is_directory(path, error) ? path : path.parent_path();
}

std::string default_vary(const std::string& project) {
  const fs::path file = folder_of(project) / "campaign.yaml";
  std::error_code error;
  return fs::exists(file, error) ? file.string() : std::string();
}

std::string host_name() {
  char name[256] = {};
  (void)gethostname(name, sizeof name - 1);
  return name;
}

std::optional<fs::path> made_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error)) {
    say(folder.string() + ": no folder can be made there; --out names another");
    return std::nullopt;
  }
  return folder;
}

// Two campaigns at a time would mix their rows. The processes of one that was killed have the lock until they are gone
// too. Where a file system has no locks nobody is kept out.
std::optional<LockFile> held_folder(const fs::path& folder) {
  constexpr std::chrono::milliseconds kWaitMax{2'000};
  constexpr std::chrono::milliseconds kLookAgain{20};
  const auto until = std::chrono::steady_clock::now() + kWaitMax;
  LockFile lock = LockFile::take(folder / ".lock");
  while (lock.state() == LockFile::State::kTaken && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(kLookAgain);
    lock = LockFile::take(folder / ".lock");
  }
  if (lock.state() == LockFile::State::kTaken) {
    say(fmt::format("{}: {} is at work there; wait for it, or name another folder with --out", folder.string(),
                    lock.other()));
    return std::nullopt;
  }
  if (lock.descriptor())
    tell_holder(*lock.descriptor(), fmt::format("sentree campaign (process {} on {})", getpid(), host_name()));
  return lock;
}

int code_of(const Diagnostic& error) {
  return error.code == "campaign.process" || error.code == "file.unwritable" ? kEnvironment : kInvalidInput;
}

// 30 s, 5 min, 2 h: as one says it.
std::string about(double s) {
  if (s < 90) return fmt::format("{:.0f} s", s);
  if (s < 5400) return fmt::format("{:.0f} min", s / 60);
  return fmt::format("{:.1f} h", s / 3600);
}

class Meter {
 public:
  void show(const campaign::Progress& progress) {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(200);
    constexpr std::size_t kWidth = 24;
    const double share = progress.of == 0 ? 1.0 : static_cast<double>(progress.done) / static_cast<double>(progress.of);
    const double rate = this->rate(progress);
    const auto full = static_cast<std::size_t>(share * kWidth);
    std::string bar;
    for (std::size_t i = 0; i < kWidth; ++i) bar += i < full ? "█" : "·";
    std::uint64_t violating = 0;
    for (const auto& requirement : progress.summary->requirements()) violating += requirement.violated > 0 ? 1 : 0;
    show_status(fmt::format("{} {} of {}  {:.0f} runs/s  {} left{}  Ctrl-C gives the result so far", bar, progress.done,
                            progress.of, rate,
                            rate > 0 ? about(static_cast<double>(progress.of - progress.done) / rate) : "?",
                            violating == 0 ? "" : fmt::format("  {} violated", violating)));
  }
  [[nodiscard]] double rate(const campaign::Progress& progress) const {
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
    return wall_s > 0 ? static_cast<double>(progress.fresh) / wall_s : 0.0;
  }
  [[nodiscard]] double wall_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
  }

 private:
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point next_ = began_;
};

int code_of(const campaign::Summary& summary) {
  if (summary.tests().empty()) {
    const bool violated = std::any_of(summary.requirements().begin(), summary.requirements().end(),
                                      [](const auto& requirement) { return requirement.violated > 0; });
    return violated || summary.ended(campaign::Outcome::kLost) > 0 ? kFindings : kOk;
  }
  bool open = false;
  for (const auto& test : summary.tests()) {
    if (test.state() == campaign::SequentialTest::State::kRefuted) return kFindings;
    open = open || test.state() == campaign::SequentialTest::State::kOpen;
  }
  return open ? kTimeLimit : kOk;
}

std::unique_ptr<campaign::Runner> load_runner(const std::string& project, const std::string& vary) {
  auto runner = campaign::Runner::load(project, vary.empty() ? std::nullopt : std::optional<fs::path>(vary));
  say(runner.diagnostics);
  return runner.ok() ? std::move(*runner.value) : nullptr;
}

// The names of expectations are those of the project.
bool parse_expectations(const std::vector<std::string>& texts, const campaign::Runner& runner, campaign::Asked& asked) {
  asked.expectations.clear();
  for (const std::string& text : texts) {
    auto parsed = campaign::parse_expectation(text, runner.requirements());
    if (!parsed) {
      say(parsed.error().message);
      return false;
    }
    asked.expectations.push_back(std::move(*parsed));
  }
  return true;
}

// A process among those that a launcher (mpirun, srun) has started together: a shard of the campaign. They share
// nothing but a folder; the first merges what all have done.
struct Rank {
  std::uint64_t index = 0;
  std::uint64_t count = 1;
  std::string job;  // tells the files of this launch from those of an earlier one
};

std::optional<Rank> rank_of_launcher() {
  struct Names {
    const char* index;
    const char* count;
  };
  constexpr Names kLaunchers[] = {
      {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"}, {"PMI_RANK", "PMI_SIZE"}, {"SLURM_PROCID", "SLURM_NTASKS"}};
  for (const Names& names : kLaunchers) {
    const char* index = std::getenv(names.index);
    const char* count = std::getenv(names.count);
    if (index == nullptr || count == nullptr) continue;
    Rank rank{std::strtoull(index, nullptr, 10), std::strtoull(count, nullptr, 10), {}};
    if (rank.count == 0 || rank.index >= rank.count) continue;
    for (const char* name : {"PMIX_NAMESPACE", "OMPI_MCA_ess_base_jobid", "SLURM_JOB_ID", "SLURM_STEP_ID", "PMI_FD"}) {
      if (const char* job = std::getenv(name)) rank.job += fmt::format("{}.", job);
    }
    return rank;
  }
  return std::nullopt;
}

fs::path rank_folder(const fs::path& folder, std::uint64_t index, std::uint64_t count) {
  return folder / fmt::format("rank-{}-of-{}", index + 1, count);
}

// What was asked in the folder; nothing: nobody ran there. A rank that died before it wrote that takes it from others.
Result<std::optional<campaign::Settings>> settings_before(const fs::path& folder, const std::optional<Rank>& rank) {
  std::vector<fs::path> folders{folder};
  for (std::uint64_t i = 0; rank && i < rank->count; ++i)
    folders.push_back(rank_folder(folder.parent_path(), i, rank->count));
  std::error_code error;
  for (const fs::path& one : folders) {
    if (!fs::exists(one / campaign::kSettingsName, error)) continue;
    auto read = campaign::read_settings(one);
    if (!read) return tl::unexpected(read.error());
    return std::optional(std::move(*read));
  }
  return std::nullopt;
}

constexpr const char* kRankFile = "rank.json";

void note_rank(const Rank& rank, const fs::path& folder, bool has_ended) {
  const Value note =
      Map{{"job", rank.job}, {"host", host_name()}, {"pid", static_cast<std::int64_t>(getpid())}, {"ended", has_ended}};
  (void)text::write_file(folder / kRankFile, to_json(note) + "\n");
}

// Waits until each of the other ranks has ended or is gone; says of those what is known.
std::vector<fs::path> await_ranks(const Rank& rank, const fs::path& folder) {
  // On another machine only its files tell of a rank: one that has written nothing for so long is given up.
  constexpr std::chrono::minutes kSilenceMax{10};
  constexpr std::chrono::milliseconds kLookAgain{100};
  std::vector<fs::path> folders;
  for (std::uint64_t i = 0; i < rank.count; ++i) {
    const fs::path of = rank_folder(folder, i, rank.count);
    std::uintmax_t size = 0;
    auto heard = std::chrono::steady_clock::now();
    while (i != rank.index && !is_interrupted()) {
      const auto source = text::read_file(of / kRankFile);
      const auto note = source ? text::parse_json(*source) : Result<Value>(Value());
      const Value none;
      const auto member = [&](const char* name) {
        const Value* found = note ? note->find(name) : nullptr;
        return found != nullptr ? *found : none;
      };
      const bool is_ours = note && member("job").text() == rank.job;
      const Value ended = member("ended");
      if (is_ours && ended.as_bool() != nullptr && *ended.as_bool()) break;
      const auto pid = static_cast<pid_t>(member("pid").number());
      const bool is_gone = is_ours && pid > 0 && member("host").text() == host_name() && kill(pid, 0) != 0;
      // It may have ended since its file was read.
      if (is_gone && text::read_file(of / kRankFile).value_or("").find("\"ended\":true") == std::string::npos) {
        say(fmt::format("rank {} of {} (process {}) died; those of its runs that it has not written are lost", i + 1,
                        rank.count, pid));
        break;
      }
      std::error_code error;
      const std::uintmax_t now = fs::file_size(of / campaign::kTableName, error);
      if (!error && now != size) heard = std::chrono::steady_clock::now();
      size = now;
      if (std::chrono::steady_clock::now() - heard > kSilenceMax) {
        say(
            fmt::format("rank {} of {} has written nothing for {} min; those of its runs that it has not written are "
                        "lost",
                        i + 1, rank.count, kSilenceMax.count()));
        break;
      }
      std::this_thread::sleep_for(kLookAgain);
    }
    std::error_code error;
    if (fs::exists(of / campaign::kTableName, error)) folders.push_back(of);
  }
  return folders;
}

// Over the result of an earlier campaign, whose least scenarios go with it.
Result<void> write_result(const fs::path& folder, const Value& result,
                          const std::map<std::string, std::string>& least) {
  if (auto taken = campaign::take_away_least(folder, least); !taken) return taken;
  return text::write_file(folder / campaign::kResultName, to_json(result) + "\n");
}

int tell_search(const campaign::Runner& runner, const campaign::Summary& summary,
                const campaign::CampaignOptions& options, const Value& result,
                const std::map<std::string, std::string>& least, bool json) {
  const auto corpus = campaign::write_corpus(runner, *options.search, options.folder / "corpus");
  const auto data = write_result(options.folder, result, least);
  for (const auto* written : {&corpus, &data}) {
    if (*written) continue;
    say(to_string(written->error()));
    return kEnvironment;
  }
  if (json)
    print(to_json(result) + "\n");
  else
    print(campaign::to_text(*options.search, summary, least) +
          fmt::format("\n{}: runs.csv, result.json, and in corpus/ the scenarios that reached something first\n",
                      options.folder.string()));
  return code_of(summary);
}

// What follows once all runs are in: least scenarios, page, data, text.
int tell(campaign::Runner& runner, const campaign::Settings& settings, const campaign::Summary& summary,
         const campaign::CampaignOptions& options, bool shrinks, bool json) {
  std::map<std::string, std::string> least;
  if (shrinks) {
    show_status("looking for the least scenario of what was violated");
    auto written = campaign::write_least(runner, summary, options);
    show_status("");
    if (!written) {
      say(to_string(written.error()));
      return kEnvironment;
    }
    least = std::move(*written);
  }
  const std::string again = fmt::format("sentree run {}{} --seed SEED", settings.project,
                                        settings.vary.empty() ? " --clock virtual" : " --vary " + settings.vary);
  Value result = options.search != nullptr ? campaign::to_value(*options.search, summary) : summary.to_value();
  if (options.coverage != nullptr) (*result.as_map())["coverage"] = options.coverage->to_value();
  // Beside the result, wherever that lies.
  Map files;
  std::map<std::string, std::string> shown;
  for (const auto& [name, file] : least) {
    shown[name] = fs::path(file).filename().string();
    files[name] = shown[name];
  }
  (*result.as_map())["least"] = std::move(files);
  if (options.search != nullptr) return tell_search(runner, summary, options, result, least, json);
  const std::string title = fmt::format("Campaign of {}", runner.plan().tree.id());
  const auto page = text::write_file(options.folder / "report.html", campaign::to_page(summary, title, again, shown));
  const auto data = write_result(options.folder, result, least);
  for (const auto* written : {&page, &data}) {
    if (*written) continue;
    say(to_string(written->error()));
    return kEnvironment;
  }
  if (json) {
    print(to_json(result) + "\n");
  } else {
    print(campaign::to_text(summary, least) + (options.coverage != nullptr ? "\n" + options.coverage->to_text() : "") +
          fmt::format("\n{}: runs.csv, result.json, report.html; any run again: {}\n", options.folder.string(), again));
  }
  return code_of(summary);
}

// What the options say, each by itself; told where one cannot be.
struct Given {
  campaign::AskedAgain asked;
  campaign::Shard shard;
  std::optional<Rank> rank;
};

std::optional<campaign::Shard> parse_shard(const std::string& text) {
  campaign::Shard shard;
  char slash = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lu%c%lu%c", &shard.index, &slash, &shard.count, &rest) == 3 && slash == '/' &&
      shard.index >= 1 && shard.index <= shard.count)
    return shard;
  say(fmt::format("--shard {}: I/N, the I-th of N parts, such as 2/4", text));
  return std::nullopt;
}

std::optional<Given> given_by(const CampaignCommand& command) {
  Given given;
  given.asked = {
      .seed = command.seed, .runs = command.runs, .confidence = {}, .precision = {}, .expectations = command.expect};
  if (!command.confidence.empty()) {
    given.asked.confidence = share("--confidence", command.confidence);
    if (!given.asked.confidence) return std::nullopt;
  }
  if (!command.precision.empty()) {
    given.asked.precision = share("--precision", command.precision);
    if (!given.asked.precision) return std::nullopt;
  }
  if (command.seed.value_or(0) > campaign::kCampaignSeedMax) {
    say(fmt::format("--seed {}: at most {}", *command.seed, campaign::kCampaignSeedMax));
    return std::nullopt;
  }
  if (!command.shard.empty()) {
    const auto shard = parse_shard(command.shard);
    if (!shard) return std::nullopt;
    given.shard = *shard;
  }
  if (command.mpi) {
    given.rank = rank_of_launcher();
    if (!given.rank) {
      say("--mpi: no launcher has started this; mpirun sentree campaign … --mpi does");
      return std::nullopt;
    }
    given.shard = {given.rank->index + 1, given.rank->count};
  }
  return given;
}

fs::path folder_for(const CampaignCommand& command, const Given& given) {
  fs::path where = !command.out.empty() ? fs::path(command.out)
                                        : folder_of(command.project) / (command.search ? "search" : "campaign");
  if (given.rank) return rank_folder(where, given.rank->index, given.rank->count);
  if (!command.out.empty() || given.shard.count == 1) return where;
  return where / fmt::format("shard-{}-of-{}", given.shard.index, given.shard.count);
}

// A campaign from its options to its result.
class CampaignSession {
 public:
  CampaignSession(const CampaignCommand& command, Given given)
      : command_(command), given_(std::move(given)), where_(folder_for(command, given_)) {}

  int run() {
    if (const int code = settle(); code != kOk) return code;
    const auto folder = made_folder(where_);
    if (!folder) return kEnvironment;
    const auto held = held_folder(*folder);
    if (!held) return kEnvironment;
    const Interrupts interruptible;
    if (given_.rank) {
      std::error_code error;
      // Nobody merges the runs of an earlier campaign.
      if (!command_.resume) fs::remove(*folder / campaign::kTableName, error);
      note_rank(*given_.rank, *folder, false);
    }
    prepare(*folder);
    const auto summary = campaign::run_campaign(*runner_, settings_, options_);
    show_status("");
    if (!summary) {
      say(to_string(summary.error()));
      return code_of(summary.error());
    }
    was_interrupted_ = take_interrupt();
    say(fmt::format("{} runs in {}, {:.1f} runs/s with {} process{}{}", last_.fresh, about(meter_.wall_s()),
                    meter_.rate(last_), options_.jobs, options_.jobs == 1 ? "" : "es",
                    was_interrupted_ ? "; interrupted: --resume goes on behind them" : ""));
    if (given_.rank) return end_rank(*given_.rank, *folder);
    if (settings_.shard.count == 1) return tell_of(*summary);
    say(fmt::format("shard {} of {} in {}; sentree campaign merge has the result", settings_.shard.index,
                    settings_.shard.count, folder->string()));
    return was_interrupted_ ? kInterrupted : kOk;
  }

 private:
  // What is asked for: by the options, by who ran there before, by the file that varies.
  int settle() {
    settings_.project = command_.project;
    settings_.vary = command_.vary.empty() ? default_vary(command_.project) : command_.vary;
    settings_.shard = given_.shard;
    campaign::Asked& asked = settings_.asked;
    std::vector<std::string> expected = command_.expect;
    const auto before =
        command_.resume ? settings_before(where_, given_.rank) : Result<std::optional<campaign::Settings>>();
    if (!before) {
      say(to_string(before.error()));
      return kInvalidInput;
    }
    if (*before) {
      auto again = campaign::ask_again((*before)->asked, given_.asked, where_);
      if (!again) {
        say(to_string(again.error()));
        return kInvalidInput;
      }
      asked = std::move(*again);
      expected.clear();
      for (const auto& expectation : asked.expectations) expected.push_back(expectation.text);
      if (command_.vary.empty()) settings_.vary = (*before)->vary;
      if (command_.shard.empty() && !given_.rank) settings_.shard = (*before)->shard;
    } else {
      asked.seed = given_.asked.seed.value_or(asked.seed);
      asked.confidence = given_.asked.confidence.value_or(asked.confidence);
      asked.precision = given_.asked.precision;
    }
    runner_ = load_runner(command_.project, settings_.vary);
    if (!runner_) return kInvalidInput;
    if (!parse_expectations(expected, *runner_, asked)) return kUsage;
    const bool may_end = asked.precision || !asked.expectations.empty();
    if (!*before) asked.runs = given_.asked.runs.value_or(runner_->vary().runs.value_or(may_end ? kRunsOpen : kRuns));
    if (asked.runs < 1 || asked.runs > campaign::kRunsMax) {
      say(fmt::format("--runs {}: from 1 to {}", asked.runs, campaign::kRunsMax));
      return kUsage;
    }
    // Nobody takes a search's runs for drawn ones.
    settings_.identity = command_.search ? hash_combine(runner_->identity(), 1) : runner_->identity();
    return kOk;
  }

  void prepare(const fs::path& folder) {
    meter_ = Meter();
    options_.jobs = command_.jobs.value_or(given_.rank ? 1U : std::max(1U, std::thread::hardware_concurrency()));
    options_.folder = folder;
    options_.resume = command_.resume;
    options_.is_interrupted = is_interrupted;
    options_.on_progress = [this](const campaign::Progress& progress) {
      last_ = progress;
      if (!given_.rank || given_.rank->index == 0) meter_.show(progress);
    };
    if (command_.coverage || command_.search) coverage_.add(runner_->plan());
    if (command_.search)
      options_.search = &search_.emplace(runner_->drawing(), std::move(coverage_), settings_.asked.seed);
    else if (command_.coverage)
      options_.coverage = &coverage_;
  }

  // The first merges what all have done.
  int end_rank(const Rank& rank, const fs::path& folder) {
    note_rank(rank, folder, true);
    if (rank.index != 0) return was_interrupted_ ? kInterrupted : kOk;
    options_.folder = where_.parent_path();
    const auto held = held_folder(options_.folder);
    if (!held) return kEnvironment;
    const auto folders = await_ranks(rank, options_.folder);
    settings_.shard = {};
    const auto merged = campaign::merge_campaign(*runner_, settings_, folders, options_.folder);
    if (merged) return tell_of(*merged);
    say(to_string(merged.error()));
    return code_of(merged.error());
  }

  int tell_of(const campaign::Summary& summary) {
    const int code =
        tell(*runner_, settings_, summary, options_, !command_.no_shrink && !was_interrupted_, command_.json);
    return was_interrupted_ ? kInterrupted : code;
  }

  const CampaignCommand& command_;
  const Given given_;
  const fs::path where_;
  campaign::Settings settings_;
  std::unique_ptr<campaign::Runner> runner_;
  campaign::CampaignOptions options_;
  campaign::Coverage coverage_;
  std::optional<campaign::Search> search_;
  Meter meter_;
  campaign::Progress last_;
  bool was_interrupted_ = false;
};

}  // namespace

int campaign(const CampaignCommand& command) {
  auto given = given_by(command);
  return given ? CampaignSession(command, std::move(*given)).run() : kUsage;
}

int campaign_merge(const CampaignCommand& command) {
  const auto first = campaign::read_settings(command.merged.front());
  if (!first) {
    say(to_string(first.error()));
    return kInvalidInput;
  }
  campaign::Settings settings = *first;
  settings.shard = {};
  std::error_code error;
  if (!fs::is_regular_file(settings.project, error) &&
      !fs::exists(fs::path(settings.project) / "sentree.yaml", error)) {
    say(
        fmt::format("{}: its project \"{}\" is not there, seen from there or from here; merge where the campaign was "
                    "started, or beside its project",
                    (fs::path(command.merged.front()) / campaign::kSettingsName).string(), settings.project));
    return kInvalidInput;
  }
  const auto runner = load_runner(settings.project, settings.vary);
  if (!runner) return kInvalidInput;
  if (runner->identity() != settings.identity) {
    say(settings.project + " is no longer what those runs were of");
    return kInvalidInput;
  }
  std::vector<std::string> expected;
  for (const auto& expectation : settings.asked.expectations) expected.push_back(expectation.text);
  if (!parse_expectations(expected, *runner, settings.asked)) return kInvalidInput;
  if (!command.confidence.empty()) {
    const auto confidence = share("--confidence", command.confidence);
    if (!confidence) return kUsage;
    settings.asked.confidence = *confidence;
  }
  const auto folder =
      made_folder(command.out.empty() ? folder_of(settings.project) / "campaign" : fs::path(command.out));
  if (!folder) return kEnvironment;
  const auto held = held_folder(*folder);
  if (!held) return kEnvironment;
  const std::vector<fs::path> shards(command.merged.begin(), command.merged.end());
  const auto summary = campaign::merge_campaign(*runner, settings, shards, *folder);
  if (!summary) {
    say(to_string(summary.error()));
    return code_of(summary.error());
  }
  const Interrupts interruptible;
  campaign::CampaignOptions options;
  options.jobs = command.jobs.value_or(std::max(1U, std::thread::hardware_concurrency()));
  options.folder = *folder;
  options.is_interrupted = is_interrupted;
  return tell(*runner, settings, *summary, options, !command.no_shrink, command.json);
}

int run_drawn(const RunCommand& command, const std::string& vary) {
  const std::uint64_t seed = command.seed.value_or(campaign::seed_of(1, 1));
  auto drawn = campaign::load_drawn(command.project, vary, seed);
  say(drawn.diagnostics);
  if (!drawn.ok()) return kInvalidInput;
  const auto folder = made_folder(folder_of(command.project) / "campaign");
  if (!folder) return kEnvironment;
  const fs::path file = *folder / fmt::format("seed-{}.yaml", seed);
  std::error_code error;
  const fs::path project = drawn.value->project.folder.empty() ? fs::path(".") : drawn.value->project.folder;
  const std::string text =
      project::scenario_text(*drawn.value, {}, std::nullopt, fs::relative(project, *folder, error).generic_string());
  if (auto written = text::write_file(file, text); !written) {
    say(to_string(written.error()));
    return kEnvironment;
  }
  say("its scenario is " + file.string());
  RunCommand alone = command;
  alone.project = file.string();
  alone.seed.reset();
  return run(alone);
}

}  // namespace sentree::cli
