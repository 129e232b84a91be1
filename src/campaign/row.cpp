#include "sentree/campaign/row.h"

#include <fmt/format.h>

#include <array>
#include <charconv>

#include "sentree/base/value.h"

namespace sentree::campaign {

namespace {

constexpr std::array<std::string_view, 4> kVerdicts{"violated", "satisfied", "held", "untested"};
constexpr std::array<std::string_view, 5> kOutcomes{"SUCCESS", "FAILURE", "RUNNING", "invalid", "lost"};

void append_cell(std::string& line, std::string_view text) {
  if (!line.empty()) line += ',';
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    line += text;
    return;
  }
  line += '"';
  for (const char c : text) {
    if (c == '"') line += '"';
    // A row is a line, so that a torn one is told.
    line += c == '\n' || c == '\r' ? ' ' : c;
  }
  line += '"';
}

std::string number(const std::optional<double>& value) { return value ? shortest_decimal(*value) : std::string(); }

std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted) {
      if (c != '"')
        cells.back() += c;
      else if (i + 1 < line.size() && line[i + 1] == '"')
        cells.back() += line[++i];
      else
        quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == ',') {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  return cells;
}

template <class Number>
std::optional<Number> parse(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

template <class Enum, std::size_t N>
std::optional<Enum> named(const std::array<std::string_view, N>& names, const std::string& text) {
  for (std::size_t i = 0; i < N; ++i) {
    if (names[i] == text) return static_cast<Enum>(i);
  }
  return std::nullopt;
}

}  // namespace

std::string_view to_string(Verdict verdict) { return kVerdicts[static_cast<std::size_t>(verdict)]; }
std::string_view to_string(Outcome outcome) { return kOutcomes[static_cast<std::size_t>(outcome)]; }

std::string csv_header(const std::vector<std::string>& requirements, const std::vector<std::string>& factors) {
  std::string line = "run,seed,mission,reason,time_s,battery_least,battery_end";
  for (const std::string& name : requirements) {
    append_cell(line, name);
    append_cell(line, name + " at_s");
  }
  for (const std::string& name : factors) append_cell(line, name);
  return line + "\n";
}

std::string csv_line(const Row& row, const std::vector<std::string>& levels) {
  std::string line = std::to_string(row.run);
  append_cell(line, std::to_string(row.seed));
  append_cell(line, to_string(row.outcome));
  append_cell(line, row.reason);
  append_cell(line, shortest_decimal(row.time_s));
  append_cell(line, number(row.battery_least));
  append_cell(line, number(row.battery_end));
  for (const Row::Requirement& requirement : row.requirements) {
    append_cell(line, to_string(requirement.verdict));
    append_cell(line, number(requirement.at_s));
  }
  for (const std::string& level : levels) append_cell(line, level);
  return line + "\n";
}

Result<Row> parse_csv_line(std::string_view line, std::size_t requirements) {
  const std::vector<std::string> cells = cells_of(line);
  constexpr std::size_t kFixed = 7;
  const auto wrong = [&](std::size_t column) {
    return fail("campaign.table", fmt::format("\"{}\" in column {} is not what a table of runs has there",
                                              column < cells.size() ? cells[column] : std::string(), column + 1));
  };
  if (cells.size() < kFixed + 2 * requirements)
    return fail("campaign.table",
                fmt::format("the row ends after {} of at least {} columns", cells.size(), kFixed + 2 * requirements));
  Row row;
  const auto run = parse<std::uint64_t>(cells[0]);
  const auto seed = parse<std::uint64_t>(cells[1]);
  const auto outcome = named<Outcome>(kOutcomes, cells[2]);
  const auto time = parse<double>(cells[4]);
  if (!run) return wrong(0);
  if (!seed) return wrong(1);
  if (!outcome) return wrong(2);
  if (!time) return wrong(4);
  row.run = *run;
  row.seed = *seed;
  row.outcome = *outcome;
  row.reason = cells[3];
  row.time_s = *time;
  row.battery_least = parse<double>(cells[5]);
  row.battery_end = parse<double>(cells[6]);
  for (std::size_t i = 0; i < requirements; ++i) {
    const auto verdict = named<Verdict>(kVerdicts, cells[kFixed + 2 * i]);
    if (!verdict) return wrong(kFixed + 2 * i);
    row.requirements.push_back({*verdict, parse<double>(cells[kFixed + 2 * i + 1])});
  }
  return row;
}

}  // namespace sentree::campaign
