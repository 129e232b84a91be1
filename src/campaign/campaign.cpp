#include "sentree/campaign/campaign.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include "sentree/base/write_all.h"
#include "sentree/campaign/detail/pool.h"
#include "sentree/campaign/detail/shrink.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"

namespace sentree::campaign {

namespace {

// Runs that may be done before an earlier one is.
constexpr std::uint64_t kRowsAheadMax = 4096;
// In the description of a least scenario.
constexpr const char* kLeastOf = ": the least of run ";

Diagnostic changed(const std::filesystem::path& folder, const std::string& what) {
  return {Severity::kError,
          "campaign.changed",
          fmt::format("{}: {}; give another folder with --out, or leave --resume out",
                      (folder / kSettingsName).string(), what),
          {}};
}

std::vector<std::string> texts(const std::vector<Level>& levels) {
  std::vector<std::string> out;
  for (const Level& level : levels) out.push_back(level.text);
  return out;
}

// Rows of a table one by one; the last may be torn, and so may the header be, of who was killed as it began.
class Table {
 public:
  Table(std::filesystem::path file, const std::string& header, std::size_t requirements)
      : file_(std::move(file)), requirements_(requirements), in_(file_, std::ios::binary) {
    std::string line;
    std::getline(in_, line);
    const bool is_torn = in_.eof();
    good_ = is_torn ? header.starts_with(line) : line + "\n" == header;
    size_ = is_torn ? 0 : header.size();
  }
  [[nodiscard]] bool is_good() const { return good_; }
  /// Octets of the whole rows that were read, and of the header.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Nothing at the end, or where a row is torn.
  Result<std::optional<Row>> next() {
    std::string line;
    if (!std::getline(in_, line) || in_.eof()) return std::nullopt;
    auto row = parse_csv_line(line, requirements_);
    if (!row) {
      row.error().message +=
          "; leave out the rows from there on, and --resume runs them again (a merge tells them as lost)";
      row.error().span = {file_.string(), line_};
      return tl::unexpected(row.error());
    }
    ++line_;
    size_ += line.size() + 1;
    return std::optional(std::move(*row));
  }

 private:
  std::filesystem::path file_;
  std::size_t requirements_;
  std::ifstream in_;
  bool good_ = false;
  std::uint64_t size_ = 0;
  int line_ = 2;  // of the next row
};

// The table as it is written. What is told of the first failure is why.
class TableFile {
 public:
  TableFile(std::filesystem::path path, bool begins) : path_(std::move(path)) {
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (begins ? O_TRUNC : O_APPEND), 0666);
    if (descriptor_ < 0) errno_ = errno;
  }
  ~TableFile() { close(); }
  TableFile(const TableFile&) = delete;
  TableFile& operator=(const TableFile&) = delete;

  void write(std::string_view text) {
    rows_ += text;
    if (rows_.size() >= kRowsMax) flush();
  }
  void flush() {
    if (is_good() && !write_all(descriptor_, rows_)) errno_ = errno;
    rows_.clear();
  }
  /// On NFS a full disk may show only now.
  void close() {
    if (descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0 && errno_ == 0) errno_ = errno;
  }
  void rename(const std::filesystem::path& as) {
    if (std::rename(path_.c_str(), as.c_str()) != 0) errno_ = errno;
  }
  [[nodiscard]] bool is_good() const { return errno_ == 0; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] tl::unexpected<Diagnostic> failure(const std::string& what_now) const {
    return fail("file.unwritable",
                fmt::format("cannot be written: {}; {}", std::generic_category().message(errno_), what_now),
                SourceSpan{path_.string()});
  }

 private:
  static constexpr std::size_t kRowsMax = 1U << 16U;
  std::filesystem::path path_;
  int descriptor_ = -1;
  int errno_ = 0;
  std::string rows_;
};

struct Removed {
  std::filesystem::path path;
  ~Removed() {
    std::error_code error;
    std::filesystem::remove(path, error);
  }
};

std::string header_of(const Runner& runner) { return csv_header(runner.requirements(), runner.factor_names()); }

Summary empty_summary(const Runner& runner, const Asked& asked) {
  return {asked, runner.requirements(), runner.drawing().factors(), runner.base().duration};
}

// What a run has reached, in front of its line.
constexpr char kReachedEnd = '|';

std::string reached_text(const std::vector<std::uint32_t>& reached) {
  std::string out;
  for (const std::uint32_t thing : reached) out += fmt::format("{} ", thing);
  return out + kReachedEnd;
}

std::vector<std::uint32_t> take_reached(std::string& text) {
  std::vector<std::uint32_t> reached;
  const char* at = text.c_str();
  for (char* end = nullptr; *at != kReachedEnd; at = end + 1)
    reached.push_back(static_cast<std::uint32_t>(std::strtoul(at, &end, 10)));
  text.erase(0, static_cast<std::size_t>(at - text.c_str()) + 1);
  return reached;
}

// Runs of a shard, in order.
std::uint64_t first_of(const Shard& shard) { return shard.index; }

bool same_campaign(const Settings& a, const Settings& b) {
  return a.identity == b.identity && a.asked.seed == b.asked.seed;
}

// But for spaces.
std::vector<std::string> texts(const std::vector<Expectation>& expectations) {
  std::vector<std::string> out;
  for (const Expectation& expectation : expectations) std::erase(out.emplace_back(expectation.text), ' ');
  return out;
}

std::string as_options(const std::vector<std::string>& expectations) {
  std::string all;
  for (const std::string& text : expectations) all += fmt::format("{}--expect \"{}\"", all.empty() ? "" : " ", text);
  return all;
}

// Of judging, which the number of runs is not.
bool judges_alike(const Asked& a, const Asked& b) {
  return a.confidence == b.confidence && a.precision == b.precision && texts(a.expectations) == texts(b.expectations);
}

}  // namespace

Result<Asked> ask_again(Asked before, const AskedAgain& now, const std::filesystem::path& folder) {
  const auto differs = [&](const std::string& then, const std::string& wanted) {
    return tl::unexpected(changed(folder, fmt::format("the runs there were asked for with {}, not {}", then, wanted)));
  };
  const auto percent = [](double share) { return fmt::format("{:.15g}%", share * 100); };
  if (now.seed && *now.seed != before.seed)
    return differs(fmt::format("--seed {}", before.seed), fmt::format("{}", *now.seed));
  if (now.confidence && *now.confidence != before.confidence)
    return differs("--confidence " + percent(before.confidence), percent(*now.confidence));
  if (now.precision && now.precision != before.precision) {
    return differs(before.precision ? "--precision " + percent(*before.precision) : "no --precision",
                   percent(*now.precision));
  }
  if (!now.expectations.empty()) {
    std::vector<Expectation> wanted;
    for (const std::string& text : now.expectations) wanted.push_back({.text = text, .subject = {}, .what = {}});
    if (texts(wanted) != texts(before.expectations)) {
      std::vector<std::string> then;
      for (const Expectation& expectation : before.expectations) then.push_back(expectation.text);
      return differs(then.empty() ? "no --expect" : as_options(then), as_options(now.expectations));
    }
  }
  if (now.runs && *now.runs < before.runs)
    return differs(fmt::format("-n {}", before.runs), fmt::format("{}", *now.runs));
  before.runs = now.runs.value_or(before.runs);
  return before;
}

Value to_value(const Settings& settings) {
  List expectations;
  for (const Expectation& expectation : settings.asked.expectations) expectations.emplace_back(expectation.text);
  return Map{
      {"project", settings.project},
      {"vary", settings.vary},
      {"seed", static_cast<std::int64_t>(settings.asked.seed)},
      {"runs", static_cast<std::int64_t>(settings.asked.runs)},
      {"confidence", settings.asked.confidence},
      {"precision", settings.asked.precision ? Value(*settings.asked.precision) : Value()},
      {"expect", std::move(expectations)},
      {"shard", List{static_cast<std::int64_t>(settings.shard.index), static_cast<std::int64_t>(settings.shard.count)}},
      {"files", fmt::format("{:016x}", settings.identity)}};
}

namespace {

constexpr const char* kProjectFrom = "project_from_here";
constexpr const char* kVaryFrom = "vary_from_here";

// A project, or what is varied, may be a file or a folder.
bool is_project(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error) || std::filesystem::exists(path / "sentree.yaml", error);
}

// Beside the names as they were given, those that hold wherever somebody works: from the folder on.
Result<void> write_settings(const Settings& settings, const std::filesystem::path& folder) {
  Value value = to_value(settings);
  const auto note = [&](const char* key, const std::string& name) {
    std::error_code error;
    const auto from = std::filesystem::relative(name, folder, error);
    if (!name.empty() && !error && !from.empty()) (*value.as_map())[key] = from.generic_string();
  };
  note(kProjectFrom, settings.project);
  note(kVaryFrom, settings.vary);
  return text::write_file(folder / kSettingsName, to_json(value) + "\n");
}

}  // namespace

Result<Settings> read_settings(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kSettingsName;
  const auto source = text::read_file(file);
  if (!source) return tl::unexpected(source.error());
  const auto value = text::parse_json(*source, file.string());
  if (!value) return tl::unexpected(value.error());
  const auto member = [&](const char* name) {
    const Value* found = value->find(name);
    return found != nullptr ? *found : Value();
  };
  Settings out;
  out.project = std::string(member("project").text());
  out.vary = std::string(member("vary").text());
  // The folder may have been moved away from its project, and then the names are as good as the present folder.
  for (const auto& [key, name] : {std::pair(kProjectFrom, &out.project), std::pair(kVaryFrom, &out.vary)}) {
    std::error_code error;
    const Value from = member(key);
    if (from.text().empty() || (std::filesystem::path(*name).is_absolute() && is_project(*name))) continue;
    const std::filesystem::path there = (folder / from.text()).lexically_normal();
    if (is_project(there)) *name = std::filesystem::proximate(there, error).string();
  }
  out.asked.seed = static_cast<std::uint64_t>(member("seed").number());
  out.asked.runs = static_cast<std::uint64_t>(member("runs").number());
  out.asked.confidence = member("confidence").number();
  if (const Value precision = member("precision"); precision.is_number()) out.asked.precision = precision.number();
  const Value shard = member("shard");
  const Value expect = member("expect");
  const List* parts = shard.as_list();
  const List* expectations = expect.as_list();
  if (parts == nullptr || parts->size() != 2 || expectations == nullptr || out.project.empty())
    return fail("campaign.settings", file.string() + " is not what a campaign writes there");
  out.shard = {static_cast<std::uint64_t>((*parts)[0].number()), static_cast<std::uint64_t>((*parts)[1].number())};
  // What they are about is known with the project: they are parsed by whoever has it.
  for (const Value& text : *expectations)
    out.asked.expectations.push_back({.text = std::string(text.text()), .subject = {}, .what = {}});
  out.identity = std::strtoull(std::string(member("files").text()).c_str(), nullptr, 16);
  return out;
}

namespace {

// A campaign that runs: its rows come as they are done and are taken in the order of the runs.
class CampaignRun {
 public:
  CampaignRun(Runner& runner, const Settings& settings, const CampaignOptions& options)
      : runner_(runner),
        settings_(settings),
        options_(options),
        things_(options.search != nullptr ? &options.search->coverage() : options.coverage),
        summary_(empty_summary(runner, settings.asked)),
        next_row_(first_of(settings.shard)) {
    const Shard& shard = settings.shard;
    progress_.of = settings.asked.runs < shard.index ? 0 : (settings.asked.runs - shard.index) / shard.count + 1;
    progress_.summary = &summary_;
  }

  Result<Summary> run() {
    std::error_code error;
    if (options_.resume && std::filesystem::exists(file_, error)) {
      if (auto resumed = resume(); !resumed) return tl::unexpected(resumed.error());
    } else if (auto free = look_for_other_shard(); !free) {
      return tl::unexpected(free.error());
    }
    if (auto written = write_settings(settings_, options_.folder); !written) return tl::unexpected(written.error());
    out_.emplace(file_, begins_);
    if (begins_) out_->write(header_);
    next_run_ = next_row_;
    generation_end_ = settings_.asked.runs + 1;
    Search* const search = options_.search;
    PoolTask task = make_task();
    do {
      if (search != nullptr) generation_end_ = std::min(next_row_ + Search::kGeneration, settings_.asked.runs + 1);
      if (auto ran = run_pool(task); !ran) return tl::unexpected(ran.error());
      if (search != nullptr) search->end_generation();
    } while (search != nullptr && out_->is_good() && !finished() && !is_interrupted());
    out_->flush();
    out_->close();
    if (!out_->is_good()) {
      return out_->failure(search != nullptr ? "the runs before are kept"
                                             : "the runs before are kept, and --resume goes on behind them");
    }
    if (options_.on_progress) options_.on_progress(progress_);
    return std::move(summary_);
  }

 private:
  struct Early {
    std::string line;
    std::vector<std::uint32_t> reached;
  };

  // Takes the rows that are there.
  Result<void> resume() {
    const Shard& shard = settings_.shard;
    const auto before = read_settings(options_.folder);
    if (!before) return tl::unexpected(before.error());
    if (!same_campaign(*before, settings_)) {
      return tl::unexpected(
          changed(options_.folder, "project, what is varied or seed are not those of the runs there"));
    }
    if (before->shard.index != shard.index || before->shard.count != shard.count)
      return tl::unexpected(changed(options_.folder, "the runs there are of another shard"));
    Table table(file_, header_, runner_.requirements().size());
    if (!table.is_good()) return tl::unexpected(changed(options_.folder, "the table there has other columns"));
    while (next_row_ <= settings_.asked.runs) {
      auto row = table.next();
      if (!row) return tl::unexpected(row.error());
      if (!*row) break;
      if ((*row)->run != next_row_)
        return fail("campaign.table", fmt::format("{}: run {} is missing", file_.string(), next_row_));
      take(**row);
      if (judges_ && summary_.done()) break;
    }
    std::error_code error;
    std::filesystem::resize_file(file_, table.size(), error);
    begins_ = error || table.size() == 0;
    return {};
  }

  // Whose runs would be overwritten.
  [[nodiscard]] Result<void> look_for_other_shard() const {
    const Shard& shard = settings_.shard;
    const auto before = read_settings(options_.folder);
    if (!before || !same_campaign(*before, settings_) || before->shard.count <= 1) return {};
    if (before->shard.index == shard.index && before->shard.count == shard.count) return {};
    return fail(
        "campaign.other-shard",
        fmt::format("{} has the runs of shard {}/{} of this campaign, which would be lost; name a folder of its "
                    "own for each shard, or remove that one",
                    options_.folder.string(), before->shard.index, before->shard.count));
  }

  // What the processes of the pool do, and what becomes of it here.
  PoolTask make_task() {
    PoolTask task;
    task.jobs = options_.jobs;
    task.next = [this]() -> std::optional<std::uint64_t> {
      const std::uint64_t apart = settings_.shard.count;
      if (finished() || next_run_ >= generation_end_ || next_run_ - next_row_ > kRowsAheadMax * apart)
        return std::nullopt;
      return std::exchange(next_run_, next_run_ + apart);
    };
    task.work = [this](std::uint64_t run) {
      const std::uint64_t seed = seed_of(settings_.asked.seed, run);
      const Seeds seeds = seeds_of(run, seed);
      const Runner::Executed executed = runner_.execute(runner_.drawing().draw(seeds), things_);
      return (things_ != nullptr ? reached_text(executed.reached) : std::string()) +
             csv_line(runner_.row(run, seed, executed), texts(runner_.drawing().levels(seeds)));
    };
    task.spoilt = [this] { return runner_.spoilt(); };
    task.done = [this](std::uint64_t run, std::string text) {
      auto reached = things_ != nullptr ? take_reached(text) : std::vector<std::uint32_t>();
      put(run, {std::move(text), std::move(reached)});
    };
    task.lost = [this](std::uint64_t run, const std::string& why) {
      Row row;
      row.run = run;
      row.seed = seed_of(settings_.asked.seed, run);
      row.reason = why;
      row.requirements.resize(runner_.requirements().size());
      put(run, {csv_line(row, texts(runner_.drawing().levels(seeds_of(run, row.seed)))), {}});
    };
    task.goes_on = [this] {
      out_->flush();
      if (options_.on_progress) options_.on_progress(progress_);
      return out_->is_good() && !finished() && !is_interrupted();
    };
    return task;
  }

  void put(std::uint64_t run, Early what) {
    early_.emplace(run, std::move(what));
    for (auto at = early_.find(next_row_); at != early_.end() && !finished(); at = early_.find(next_row_)) {
      Early& next = at->second;
      std::string_view text = next.line;
      text.remove_suffix(1);
      const auto row = parse_csv_line(text, runner_.requirements().size());
      out_->write(next.line);
      ++progress_.fresh;
      take(row ? *row : Row{.run = at->first, .seed = seed_of(settings_.asked.seed, at->first)});
      if (options_.coverage != nullptr) options_.coverage->reach(next.reached);
      if (options_.search != nullptr) options_.search->take(at->first, std::move(next.reached));
      early_.erase(at);
    }
  }

  void take(const Row& row) {
    if (judges_ || !summary_.done()) summary_.add(row, runner_.drawing().levels(seeds_of(row.run, row.seed)));
    if (options_.search != nullptr && is_first(row.run)) options_.search->keep(row.run);
    ++progress_.done;
    next_row_ += settings_.shard.count;
  }

  // Of its kind: the one that is shown as the least of them.
  [[nodiscard]] bool is_first(std::uint64_t run) const {
    return summary_.failing().first_run == run ||
           std::any_of(summary_.requirements().begin(), summary_.requirements().end(),
                       [&](const auto& requirement) { return requirement.first_run == run; });
  }
  [[nodiscard]] Seeds seeds_of(std::uint64_t run, std::uint64_t seed) const {
    return options_.search != nullptr ? options_.search->seeds(run) : runner_.drawing().seeds(seed);
  }
  [[nodiscard]] bool finished() const { return (judges_ && summary_.done()) || next_row_ > settings_.asked.runs; }
  [[nodiscard]] bool is_interrupted() const { return options_.is_interrupted && options_.is_interrupted(); }

  Runner& runner_;
  const Settings& settings_;
  const CampaignOptions& options_;
  const std::filesystem::path file_ = options_.folder / kTableName;
  const std::string header_ = header_of(runner_);
  const Coverage* const things_;
  // A shard's runs are not in the order of all, so it does not judge by them when to end.
  const bool judges_ = settings_.shard.count == 1;
  Summary summary_;
  Progress progress_;
  std::optional<TableFile> out_;
  bool begins_ = true;                    // the table
  std::map<std::uint64_t, Early> early_;  // by run
  std::uint64_t next_row_;
  std::uint64_t next_run_ = 0;
  std::uint64_t generation_end_ = 0;  // the first run behind it
};

}  // namespace

Result<Summary> run_campaign(Runner& runner, const Settings& settings, const CampaignOptions& options) {
  return CampaignRun(runner, settings, options).run();
}

Result<Summary> merge_campaign(const Runner& runner, const Settings& settings,
                               const std::vector<std::filesystem::path>& shards, const std::filesystem::path& folder) {
  struct Source {
    std::filesystem::path folder;
    Settings settings;
    Table table;
    std::optional<Row> row;
  };
  const std::string header = header_of(runner);
  Settings merged = settings;
  merged.shard = {};
  std::vector<Source> sources;
  const auto advance = [](Source& source) -> Result<void> {
    auto row = source.table.next();
    if (!row) return tl::unexpected(row.error());
    source.row = std::move(*row);
    return {};
  };
  std::error_code error;
  for (const auto& shard : shards) {
    if (std::filesystem::equivalent(shard, folder, error)) {
      return fail("campaign.other-shard",
                  fmt::format("{} is one of the shards, whose runs would be written over; --out names another folder",
                              shard.string()));
    }
    const auto other = read_settings(shard);
    if (!other) return tl::unexpected(other.error());
    if (!same_campaign(*other, settings))
      return fail("campaign.changed", (shard / kSettingsName).string() +
                                          ": its project, what is varied, or its seed are not those of the others");
    if (!sources.empty() && !judges_alike(sources.front().settings.asked, other->asked))
      return fail("campaign.changed",
                  fmt::format("{}: --confidence, --precision or --expect are not those of {}",
                              (shard / kSettingsName).string(), (sources.front().folder / kSettingsName).string()));
    merged.asked.runs = std::max(merged.asked.runs, other->asked.runs);
    sources.push_back({shard, *other, Table(shard / kTableName, header, runner.requirements().size()), std::nullopt});
    if (!sources.back().table.is_good())
      return fail("campaign.table", (shard / kTableName).string() + " is no table of this campaign");
    if (auto first = advance(sources.back()); !first) return tl::unexpected(first.error());
  }
  Summary summary = empty_summary(runner, merged.asked);
  // What is there stays until the table is whole.
  TableFile out(folder / (std::string(kTableName) + ".part"), true);
  const Removed unless_whole{out.path()};
  out.write(header);
  for (std::uint64_t run = 1; run <= merged.asked.runs && !summary.done(); ++run) {
    Row row;
    row.run = run;
    row.seed = seed_of(settings.asked.seed, run);
    row.reason = "no shard has it";
    row.requirements.resize(runner.requirements().size());
    for (Source& source : sources) {
      while (source.row && source.row->run < run) {
        if (auto on = advance(source); !on) return tl::unexpected(on.error());
      }
      const Settings& of = source.settings;
      if (source.row && source.row->run == run)
        row = *source.row;
      else if (run > of.asked.runs && (run - 1) % of.shard.count == of.shard.index - 1)
        row.reason = fmt::format("{} was asked for {} runs only", source.folder.string(), of.asked.runs);
    }
    const auto levels = runner.drawing().levels(row.seed);
    out.write(csv_line(row, texts(levels)));
    summary.add(row, levels);
  }
  out.flush();
  out.close();
  if (out.is_good()) out.rename(folder / kTableName);
  if (!out.is_good()) return out.failure("the shards are as they were");
  if (auto written = write_settings(merged, folder); !written) return tl::unexpected(written.error());
  return summary;
}

Result<std::map<std::string, std::string>> write_least(Runner& runner, const Summary& summary,
                                                       const CampaignOptions& options) {
  std::vector<Summary::Requirement> found;
  for (const auto& requirement : summary.requirements()) {
    if (requirement.first_run != 0) found.push_back(requirement);
  }
  if (summary.failing().first_run != 0) found.push_back(summary.failing());
  std::error_code error;
  const auto project = std::filesystem::relative(
      runner.base().project.folder.empty() ? "." : runner.base().project.folder, options.folder, error);
  std::map<std::string, std::string> files;
  std::optional<Diagnostic> unwritten;
  std::uint64_t next = 0;
  PoolTask task;
  task.jobs = options.jobs;
  task.next = [&]() -> std::optional<std::uint64_t> {
    if (next >= found.size()) return std::nullopt;
    return next++;
  };
  task.work = [&](std::uint64_t index) {
    const auto& of = found[index];
    const Seeds* const seeds = options.search != nullptr ? options.search->kept(of.first_run) : nullptr;
    const auto least = shrink(
        runner, seeds != nullptr ? runner.drawing().draw(*seeds) : runner.drawing().draw(of.first_seed), of.name);
    if (!least) return std::string();
    const std::string about =
        fmt::format("{}{}{} (seed {})", of.name == "mission" ? "the mission fails" : of.name + " is violated", kLeastOf,
                    of.first_run, of.first_seed);
    return least_text(runner, *least, about, error ? std::string() : project.generic_string());
  };
  task.spoilt = [&] { return runner.spoilt(); };
  task.done = [&](std::uint64_t index, const std::string& text) {
    if (text.empty()) return;
    const std::filesystem::path file = options.folder / (found[index].name + ".yaml");
    if (auto written = text::write_file(file, text))
      files[found[index].name] = file.string();
    else
      unwritten = written.error();
  };
  task.lost = [](std::uint64_t, const std::string&) {};
  task.goes_on = [&] { return !(options.is_interrupted && options.is_interrupted()); };
  if (auto ran = run_pool(task); !ran) return tl::unexpected(ran.error());
  if (unwritten) return tl::unexpected(*unwritten);
  return files;
}

Result<void> take_away_least(const std::filesystem::path& folder, const std::map<std::string, std::string>& kept) {
  std::error_code error;
  const auto result = text::read_file(folder / kResultName);
  const auto before = result ? text::parse_json(*result) : Result<Value>(Value());
  const Value* const least = before ? before->find("least") : nullptr;
  const Map* const files = least != nullptr ? least->as_map() : nullptr;
  if (files == nullptr) return {};
  const auto written = std::filesystem::last_write_time(folder / kResultName, error);
  for (const auto& [name, file] : *files) {
    const std::filesystem::path path = folder / file.text();
    // Nobody else's: named as one of a requirement, worded as one, and not edited since.
    if (kept.contains(name) || file.text() != name + ".yaml" || name.find('/') != std::string::npos ||
        std::filesystem::last_write_time(path, error) > written || error ||
        text::read_file(path).value_or("").find(kLeastOf) == std::string::npos)
      continue;
    if (!std::filesystem::remove(path, error) && error)
      return fail("file.unwritable", "cannot be taken away: " + error.message(), SourceSpan{path.string()});
  }
  return {};
}

}  // namespace sentree::campaign
