#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "sentree/cli/commands.h"
#include "sentree/cli/output.h"
#include "sentree/cli/resume.h"
#include "sentree/record/reader.h"
#include "sentree/replay/recorded_run.h"
#include "sentree/replay/recording.h"
#include "sentree/text/json.h"

namespace sentree::cli {

namespace {

Value facts_of(record::Reader& reader) {
  Map facts;
  for (const record::MetadataIndex& index : reader.metadata()) {
    const auto metadata = reader.metadata(index);
    if (!metadata) continue;
    Map entries;
    for (const auto& [key, value] : metadata->entries) entries[key] = value;
    facts[index.name] = std::move(entries);
  }
  return facts;
}

double seconds_of(std::uint64_t ns) { return static_cast<double>(ns) * 1e-9; }

Value info_value(record::Reader& reader) {
  const record::Statistics& statistics = reader.statistics();
  List topics;
  for (const auto& [id, channel] : reader.channels()) {
    const auto count = statistics.channel_messages.find(id);
    const auto schema = reader.schemas().find(channel.schema);
    topics.push_back(
        Map{{"topic", channel.topic},
            {"messages", static_cast<std::int64_t>(count != statistics.channel_messages.end() ? count->second : 0)},
            {"schema", schema != reader.schemas().end() ? schema->second.name : ""},
            {"encoding", channel.encoding}});
  }
  List attachments;
  for (const record::AttachmentIndex& attachment : reader.attachments())
    attachments.push_back(Map{{"name", attachment.name}, {"bytes", static_cast<std::int64_t>(attachment.data_size)}});
  Map value{{"library", reader.library()},
            {"complete", reader.complete()},
            {"bytes", static_cast<std::int64_t>(reader.size())},
            {"messages", static_cast<std::int64_t>(statistics.messages)},
            {"chunks", static_cast<std::int64_t>(statistics.chunks)},
            {"begins", seconds_of(statistics.start_time)},
            {"ends", seconds_of(statistics.end_time)},
            {"metadata", facts_of(reader)},
            {"topics", std::move(topics)},
            {"attachments", std::move(attachments)}};
  if (!reader.problems().empty()) value["problems"] = cli::to_value(reader.problems());
  return value;
}

std::string info_text(record::Reader& reader, const std::string& file) {
  const Value facts = facts_of(reader);
  const auto fact = [&](std::string_view group, std::string_view key) {
    const Value* value = facts.at({group, key});
    return value != nullptr ? std::string(value->text()) : std::string();
  };
  const record::Statistics& statistics = reader.statistics();
  std::string text = file + "\n";
  const std::string scenario = fact(replay::kRunMetadata, "scenario");
  if (!scenario.empty()) {
    const std::string started = fact(replay::kRunMetadata, "started");
    text += fmt::format("  scenario {}, {} time, seed {}{}\n", scenario, fact(replay::kRunMetadata, "clock"),
                        fact(replay::kRunMetadata, "seed"), started.empty() ? "" : ", started " + started);
  }
  if (const std::string before = fact(replay::kRunMetadata, "continues"); !before.empty()) {
    const std::string at = fact(replay::kRunMetadata, "continues_at_ns");
    text += fmt::format("  continues {} at {:.3f} s\n", before, 1e-9 * std::strtod(at.c_str(), nullptr));
  }
  if (const std::string next = runtime::continued_by(journal_of(file)); !next.empty())
    text += fmt::format("  continued by {}\n", next);
  const std::string mission = fact(replay::kResultMetadata, "mission");
  if (!mission.empty()) {
    const std::string reason = fact(replay::kResultMetadata, "reason");
    text += fmt::format("  mission {}{}, ended by {}\n", mission, reason.empty() ? "" : fmt::format(" ({})", reason),
                        fact(replay::kResultMetadata, "ended_by"));
    if (const auto verdicts = text::parse_json(fact(replay::kResultMetadata, "verdicts"));
        verdicts && verdicts->as_map() != nullptr) {
      for (const auto& [name, verdict] : *verdicts->as_map()) {
        const char* mark = verdict.text() == "violated" ? "✗" : verdict.text() == "satisfied" ? "✓" : "·";
        text += fmt::format("  {} monitor {}: {}\n", mark, name, verdict.text());
      }
    }
  }
  text += fmt::format("  {:.3f} s to {:.3f} s, {} messages in {} chunks, {} bytes, written by {}\n",
                      seconds_of(statistics.start_time), seconds_of(statistics.end_time), statistics.messages,
                      statistics.chunks, reader.size(), reader.library());
  std::size_t width = 0;
  for (const auto& [id, channel] : reader.channels()) width = std::max(width, channel.topic.size());
  for (const auto& [id, channel] : reader.channels()) {
    const auto count = statistics.channel_messages.find(id);
    if (count == statistics.channel_messages.end()) continue;
    const auto schema = reader.schemas().find(channel.schema);
    text += fmt::format("  {:<{}}  {:>9}  {}\n", channel.topic, width, count->second,
                        schema != reader.schemas().end() ? schema->second.name : channel.encoding);
  }
  std::uint64_t attached = 0;
  for (const record::AttachmentIndex& attachment : reader.attachments()) attached += attachment.data_size;
  if (!reader.attachments().empty())
    text += fmt::format("  {} files attached, {} bytes\n", reader.attachments().size(), attached);
  return text;
}

}  // namespace

int info(const InfoCommand& command) {
  const auto reader = record::Reader::open(command.file);
  if (!reader) {
    say(to_string(reader.error()));
    return kInvalidInput;
  }
  say_each((*reader)->problems());
  print(command.json ? to_json(info_value(**reader)) + "\n" : info_text(**reader, command.file));
  return kOk;
}

}  // namespace sentree::cli
