#include "sentree/replay/recorded_run.h"

#include <fmt/ranges.h>
#include <openssl/sha.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <set>

#include <fmt/format.h>

#include "sentree/base/json.h"
#include "sentree/base/temporary_folder.h"
#include "sentree/idl/conform.h"
#include "sentree/mission/tree.h"
#include "sentree/project/scenario_text.h"
#include "sentree/record/compression.h"
#include "sentree/record/observation.h"
#include "sentree/replay/recording.h"
#include "sentree/text/file.h"
#include "sentree/text/json.h"
#include "sentree/text/read_fence.h"

namespace sentree::replay {

namespace fs = std::filesystem;

namespace {

template <class Number>
std::optional<Number> to_number(std::string_view text) {
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// A name that stays below the folder it is put into.
bool is_harmless(const fs::path& name) {
  if (name.empty() || name.is_absolute()) return false;
  for (const fs::path& part : name) {
    if (part == "..") return false;
  }
  return name.string().find('\0') == std::string::npos;
}

}  // namespace

struct RecordedRun::Folder {
  explicit Folder(const std::string& root) : seal(files.path(), root) {}
  TemporaryFolder files{"recording"};
  // Nobody vouches for what it names.
  text::SealedFolder seal;
  fs::path source;
};

RecordedRun::RecordedRun() = default;
RecordedRun::RecordedRun(RecordedRun&&) noexcept = default;
RecordedRun& RecordedRun::operator=(RecordedRun&&) noexcept = default;
RecordedRun::~RecordedRun() = default;

Result<RecordedRun> RecordedRun::open(const std::string& path) {
  auto reader = record::Reader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  RecordedRun run;
  run.path_ = path;
  run.reader_ = std::move(*reader);
  if (run.reader_->channels_of(record::kObservationsTopic).empty())
    return fail("record.not-a-run",
                fmt::format("no recording of a run: it has no topic {}", record::kObservationsTopic), SourceSpan{path});
  for (const record::MetadataIndex& index : run.reader_->metadata()) {
    if (index.name != kRunMetadata && index.name != kResultMetadata) continue;
    const auto metadata = run.reader_->metadata(index);
    if (!metadata) return tl::unexpected(metadata.error());
    for (const auto& [key, value] : metadata->entries) run.facts_[key] = value;
  }
  return run;
}

std::string RecordedRun::fact(std::string_view name) const {
  const auto found = facts_.find(name);
  return found != facts_.end() ? found->second : std::string();
}

std::string RecordedRun::begun_in() const {
  std::string first = fact("continues");
  std::set<std::string> seen;
  while (!first.empty() && seen.insert(first).second) {
    const auto before = open((fs::path(path_).parent_path() / first).string());
    const std::string further = before ? before->fact("continues") : std::string();
    if (further.empty()) break;
    first = further;
  }
  return first;
}

TimePoint RecordedRun::ended() const {
  if (const auto ns = to_number<std::int64_t>(fact("ended_ns"))) return TimePoint(Duration(*ns));
  return TimePoint(Duration(static_cast<std::int64_t>(reader_->statistics().end_time)));
}

TimePoint RecordedRun::judged_until() const {
  const auto mission = bt::parse_status(fact("mission"));
  const std::string by = fact("ended_by");
  const bool is_cut_off = by == "time limit" || by == "interrupt";
  return mission::judged_until(ended(), mission && bt::is_completed(*mission) && !is_cut_off);
}

Result<void> RecordedRun::each(const std::function<bool(Message)>& take, TimePoint from, TimePoint to) {
  return each_of(record::kObservationsTopic, take, from, to);
}

Result<std::vector<Message>> RecordedRun::interventions(TimePoint from) {
  std::vector<Message> all;
  if (reader_->channels_of(kInterventionsTopic).empty()) return all;
  auto read = each_of(
      kInterventionsTopic,
      [&](Message message) {
        all.push_back(std::move(message));
        return true;
      },
      from, kNever);
  if (!read) return tl::unexpected(read.error());
  return all;
}

Result<void> RecordedRun::each_of(std::string_view topic, const std::function<bool(Message)>& take, TimePoint from,
                                  TimePoint to) {
  std::optional<Diagnostic> failure;
  const record::Query query{.channels = reader_->channels_of(topic),
                            .from = static_cast<std::uint64_t>(from.time_since_epoch().count()),
                            .to = static_cast<std::uint64_t>(to.time_since_epoch().count())};
  auto read = reader_->read(query, [&](const record::RawMessage& raw) {
    auto message = record::read_observation(raw);
    if (!message) {
      failure = message.error();
      failure->span.file = path_;
      return false;
    }
    return take(std::move(*message));
  });
  if (failure) return tl::unexpected(*failure);
  return read;
}

Result<std::vector<Message>> RecordedRun::observations(TimePoint to) {
  std::vector<Message> all;
  auto read = each(
      [&](Message message) {
        all.push_back(std::move(message));
        return true;
      },
      TimePoint{}, to);
  if (!read) return tl::unexpected(read.error());
  return all;
}

namespace {

// The saved run in a snapshot; empty: there is none.
std::string state_of(const Value& snapshot) {
  const Value* state = snapshot.find("state");
  const Value* size = snapshot.find("size");
  const Bytes* packed = state != nullptr ? state->as_bytes() : nullptr;
  const std::int64_t* octets = size != nullptr ? size->as_int() : nullptr;
  if (packed == nullptr || octets == nullptr || *octets < 0 || *octets > kSnapshotStateMax) return {};
  return record::decompress("zstd", {reinterpret_cast<const char*>(packed->octets.data()), packed->octets.size()},
                            static_cast<std::size_t>(*octets))
      .value_or(std::string());
}

}  // namespace

Result<std::optional<RecordedRun::Snapshot>> RecordedRun::snapshot(TimePoint time) {
  std::optional<Snapshot> found;
  std::string text;
  record::Query query{.channels = reader_->channels_of(kSnapshotTopic),
                      .to = static_cast<std::uint64_t>(time.time_since_epoch().count())};
  if (query.channels.empty()) return found;
  // Backwards, so that what lies long before it is not read.
  for (auto back = static_cast<std::uint64_t>(kSnapshotPeriod.count()); !found; back *= 2) {
    query.from = query.to > back ? query.to - back : 0;
    auto read = reader_->read(query, [&](const record::RawMessage& raw) {
      found = Snapshot{.time = TimePoint(Duration(static_cast<std::int64_t>(raw.log_time))), .value = {}, .state = {}};
      text = raw.data;
      return true;
    });
    if (!read) return tl::unexpected(read.error());
    if (query.from == 0) break;
  }
  if (!found) return found;
  auto value = text::parse_json(text, path_);
  if (!value) return tl::unexpected(value.error());
  found->value = with_bytes(std::move(*value));
  found->state = state_of(found->value);
  const Value* sequence = found->value.find("sequence");
  if (sequence != nullptr && sequence->as_int() != nullptr)
    found->sequence = static_cast<std::uint64_t>(*sequence->as_int());
  return found;
}

Result<fs::path> RecordedRun::extract() {
  if (folder_) return folder_->source;
  auto folder = std::make_unique<Folder>(fact("root"));
  if (folder->files.path().empty())
    return fail("file.unwritable", "no temporary folder can be made", SourceSpan{path_});
  const auto put = [&](const std::string& name, const std::string& content) -> Result<void> {
    if (!is_harmless(name))
      return fail("record.bad-name", fmt::format("attachment \"{}\" would lie outside of its folder", name),
                  SourceSpan{path_});
    std::error_code error;
    fs::create_directories((folder->files.path() / name).parent_path(), error);
    return text::write_file(folder->files.path() / name, content);
  };
  bool any = false;
  for (const record::AttachmentIndex& index : reader_->attachments()) {
    if (!index.name.starts_with(kProjectPrefix)) continue;
    const auto attachment = reader_->attachment(index);
    if (!attachment) return tl::unexpected(attachment.error());
    if (auto written = put(index.name.substr(kProjectPrefix.size()), attachment->data); !written)
      return tl::unexpected(written.error());
    any = true;
  }
  const std::string source = fact("source");
  if (!any || source.empty() || !is_harmless(source))
    return fail("record.no-project", "the recording holds no project to run again", SourceSpan{path_});
  folder->source = folder->files.path() / source;
  folder_ = std::move(folder);
  return folder_->source;
}

void RecordedRun::apply_facts(project::Scenario& scenario) const {
  scenario.virtual_time = is_virtual();
  if (const auto seed = to_number<std::uint64_t>(fact("seed"))) scenario.seed = *seed;
  if (const auto ns = to_number<std::int64_t>(fact("duration_ns"))) scenario.duration = Duration(*ns);
  // Deadlines are wall time.
  if (const auto factor = to_number<double>(fact("factor")); factor && *factor > 0) scenario.factor = *factor;
}

namespace {

Loaded<project::Scenario> load_either(const fs::path& file, bool plain) {
  if (!plain) return project::load_scenario(file);
  auto project = project::load_project(file);
  Loaded<project::Scenario> loaded;
  loaded.diagnostics = std::move(project.diagnostics);
  if (project.value) loaded.value = project::plain_scenario(std::move(*project.value));
  return loaded;
}

}  // namespace

namespace {

std::string sha256(std::string_view bytes) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> digest{};
  SHA256(reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), digest.data());
  return fmt::format("{:02x}", fmt::join(digest, ""));
}

// Whether it was attached; what a recording names elsewhere is a file of this machine.
bool is_attached(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const fs::path inside = fs::weakly_canonical(file, error).lexically_relative(fs::weakly_canonical(folder, error));
  return !error && is_harmless(inside.string()) && fs::is_regular_file(file, error);
}

// What the user has to know of a plug-in to decide whether it may run.
Diagnostic told(const project::FileRef& plugin, const fs::path& file, const fs::path& folder, RecordedCode code) {
  if (!is_attached(file, folder)) {
    return {Severity::kError, "record.plugin",
            fmt::format("plug-in {} is not in the recording; --project runs it with the plug-ins of a project",
                        plugin.path),
            plugin.span};
  }
  const auto content = text::read_file(file);
  const std::string what = plugin.path + (content ? fmt::format(" (SHA-256 {})", sha256(*content))
                                                  : fmt::format(" ({})", content.error().message));
  if (code == RecordedCode::kLoaded) {
    return {Severity::kNote, "record.plugin",
            fmt::format("plug-in {} of the recording is loaded, as --allow-plugins says", what), plugin.span};
  }
  return {Severity::kError, "record.plugin",
          fmt::format(
              "plug-in {} comes with the recording, and its code would run with your rights; --allow-plugins loads it",
              what),
          plugin.span};
}

}  // namespace

Loaded<project::Scenario> RecordedRun::scenario(RecordedCode code) {
  const auto file = extract();
  if (!file) return {.value = std::nullopt, .diagnostics = {file.error()}};
  auto loaded = load_either(*file, fact("source") == fact("project"));
  if (!loaded.value) {
    loaded.diagnostics = errors_in(std::move(loaded.diagnostics));
    return loaded;
  }
  loaded.value->name = fact("scenario");
  apply_facts(*loaded.value);
  const project::Project& project = loaded.value->project;
  for (const project::FileRef& plugin : project.plugins) {
    loaded.diagnostics.push_back(told(plugin, project.folder / plugin.path, folder_->files.path(), code));
    SourceSpan& where = loaded.diagnostics.back().span;
    where.file = named(std::move(where.file));
  }
  if (has_errors(loaded.diagnostics)) loaded.value.reset();
  return loaded;
}

Diagnostics RecordedRun::errors_in(Diagnostics found) const {
  std::erase_if(found, [](const Diagnostic& one) { return one.severity != Severity::kError; });
  for (Diagnostic& one : found) {
    one.span.file = named(std::move(one.span.file));
    one.message = named(std::move(one.message));
  }
  return found;
}

std::string RecordedRun::named(std::string text) const {
  if (!folder_) return text;
  const std::string folder = folder_->files.path().string();
  for (auto at = text.find(folder); at != std::string::npos; at = text.find(folder, at + path_.size()))
    text.replace(at, folder.size(), path_);
  return text;
}

Loaded<project::Scenario> RecordedRun::scenario_in(const std::string& project) {
  const bool plain = fact("source") == fact("project");
  std::error_code error;
  fs::path file = project;
  if (!plain && (fs::is_directory(file, error) || file.filename() == "sentree.yaml")) {
    const fs::path folder = fs::is_directory(file, error) ? file : file.parent_path();
    const fs::path source = fact("source");
    const fs::path inside = source.lexically_relative(fs::path(fact("project")).parent_path());
    file = folder / (is_harmless(inside.string()) ? inside : "scenarios" / source.filename());
    if (!fs::exists(file, error)) return attached_over(folder, file.lexically_relative(folder).generic_string());
  }
  auto loaded = load_either(file, plain);
  if (loaded.value) apply_facts(*loaded.value);
  return loaded;
}

Loaded<project::Scenario> RecordedRun::attached_over(const fs::path& folder, const std::string& missing) {
  Loaded<project::Scenario> loaded;
  auto project = project::load_project(folder);
  loaded.diagnostics = std::move(project.diagnostics);
  if (!project.ok()) return loaded;
  const auto file = extract();
  if (!file) {
    loaded.diagnostics.push_back(file.error());
    return loaded;
  }
  auto attached = project::load_scenario_of(*project.value, *file);
  for (Diagnostic& found : attached.diagnostics) {
    found.span.file = named(std::move(found.span.file));
    found.message = named(std::move(found.message));
    loaded.diagnostics.push_back(std::move(found));
  }
  if (!attached.value) return loaded;
  attached.value->file = named(file->string());
  loaded.diagnostics.push_back({Severity::kNote, "replay.scenario",
                                fmt::format("{} has no {}; the scenario is the recorded one", folder.string(), missing),
                                SourceSpan{attached.value->file}});
  apply_facts(*attached.value);
  loaded.value = std::move(attached.value);
  return loaded;
}

void restore_numbers(const project::Plan& plan, Message& message) {
  const auto dot = message.name.find('.');
  if (dot == std::string::npos || message.kind == MessageKind::kEvent) return;
  const auto service = plan.services.find(message.name.substr(0, dot));
  if (service == plan.services.end()) return;
  const idl::Method* method =
      service->second.service->find(message.name.substr(dot + 1, message.name.rfind('.') - dot - 1));
  Map* data = message.data.as_map();
  if (method == nullptr || data == nullptr) return;
  if (Value* args = data->find("args")) {
    if (auto conformed = idl::conform_arguments(*method, *args)) *args = std::move(*conformed);
  }
  if (Value* result = data->find("result")) {
    if (auto conformed = idl::conform(*method->result, *result, "result")) *result = std::move(*conformed);
  }
}

Result<std::string> recorded_scenario_text(RecordedRun& run, const std::string& project) {
  // Nothing of it is loaded.
  auto scenario = run.scenario(RecordedCode::kLoaded);
  if (!scenario.value) return tl::unexpected(scenario.diagnostics.front());
  std::vector<project::Injection> done;
  project::RunOutcome outcome;
  auto read = run.each([&](const Message& message) {
    if (message.name == "scenario.injection" && message.source != "scenario") {
      if (auto what = project::intervention_of(message))
        done.push_back({.at = message.time, .what = std::move(*what), .source = message.source, .span = {}});
    } else if (message.name == "mission.status") {
      const std::string status(message.data.find("status") != nullptr ? message.data.find("status")->text() : "");
      outcome.mission = status == "SUCCESS" || status == "FAILURE" || status == "RUNNING" ? status : "";
    } else if (message.name == "monitor.violated" || message.name == "monitor.satisfied") {
      if (const Value* monitor = message.data.find("monitor"))
        outcome.verdicts[std::string(monitor->text())] = message.name.substr(message.name.find('.') + 1);
    }
    return true;
  });
  if (!read) return tl::unexpected(read.error());
  // One that was cut off says nothing about how it would have ended.
  const std::string ended_by = run.fact("ended_by");
  const bool whole = !ended_by.empty() && ended_by != "error" && ended_by != "interrupt";
  return project::scenario_text(*scenario.value, done, whole ? std::optional(outcome) : std::nullopt, project);
}

}  // namespace sentree::replay
