// Runs a folder of the W3C's SCXML documents (ECMAScript form) by their manifest.xml: a document passes if it comes to
// rest in the state "pass". Virtual time; HTTP, where a document asks for it, over a loopback socket.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/value.h"
#include "sentree/http/http.h"
#include "sentree/scxml/chart.h"
#include "sentree/scxml/detail/basic_http.h"
#include "sentree/scxml/step.h"
#include "sentree/text/file.h"
#include "sentree/text/xml.h"

namespace sentree {
namespace {

// No document of the suite waits longer than this for something to happen.
constexpr Duration kRunTimeMax = std::chrono::seconds(120);

struct Test {
  std::string id;      // as in the file's name: 403a
  std::string number;  // as in the manifest: 403
  bool manual = false;
};

struct Verdict {
  bool passed = false;
  std::string why;
};

std::string stem_of(std::string_view uri) {
  const std::size_t slash = uri.rfind('/');
  if (slash != std::string_view::npos) uri.remove_prefix(slash + 1);
  uri = uri.substr(0, uri.rfind('.'));
  if (uri.starts_with("test")) uri.remove_prefix(4);
  return std::string(uri);
}

Result<std::vector<Test>> read_manifest(const std::filesystem::path& folder) {
  auto source = text::read_file(folder / "manifest.xml");
  if (!source) return tl::unexpected(std::move(source.error()));
  auto document = text::XmlDocument::parse(*std::move(source), (folder / "manifest.xml").string());
  if (!document) return tl::unexpected(std::move(document.error()));
  std::vector<Test> tests;
  for (const auto& assertion : document->root().children()) {
    for (const auto& test : assertion.children()) {
      if (test.local_name() != "test") continue;
      for (const auto& start : test.children()) {
        if (start.local_name() != "start") continue;
        tests.push_back({stem_of(start.attribute("uri").value_or("")), std::string(test.attribute("id").value_or("")),
                         test.attribute("manual").value_or("false") == "true"});
      }
    }
  }
  return tests;
}

class Player {
 public:
  explicit Player(const std::filesystem::path& folder) {
    host_.read = [folder](std::string_view uri) -> Result<std::string> {
      std::string name(uri.starts_with("file:") ? uri.substr(5) : uri);
      return text::read_file(folder / std::filesystem::path(name).filename());
    };
    // Off the loopback interface nothing is needed, and nothing is sent.
    auto server = http::Server::listen("127.0.0.1", 0, [this](const http::Request& request) {
      const std::lock_guard lock(mutex_);
      inbox_.push_back(scxml::from_http(request.method, request.header("Content-Type"), request.body, request.text()));
      return http::Response();
    });
    if (server) server_.emplace(*std::move(server));
    host_.processors.push_back({std::string(scxml::kBasicHttpProcessor), server_ ? server_->url() + "/" : ""});
    host_.yield_after_send = true;
  }

  Verdict run(const std::filesystem::path& file) {
    auto source = text::read_file(file);
    if (!source) return {false, source.error().message};
    scxml::LoadOptions options;
    options.read = host_.read;
    const auto loaded = scxml::load(*source, file.filename().string(), options);
    if (!loaded.ok()) return {false, loaded.diagnostics.empty() ? "refused" : to_string(loaded.diagnostics.front())};
    const scxml::Chart& chart = *loaded.value;
    scxml::Session session;
    TimePoint now{};
    scxml::Effects effects;
    scxml::start(chart, session, {}, now, effects, host_);
    while (session.running()) {
      if (post(effects)) {
        deliver(chart, session, now, effects);
        continue;
      }
      const TimePoint next = session.next_timer();
      if (next > TimePoint(kRunTimeMax)) break;
      now = std::max(now, next);
      scxml::step_timers(chart, session, now, effects, host_);
    }
    if (session.failure()) return {false, to_string(*session.failure())};
    std::string states;
    for (const std::string& id : session.active_ids(chart)) states += " " + id;
    return {states == " pass", "ends in" + states};
  }

 private:
  // Posts what the last step sent over HTTP. An answer means that the server, ours too, has taken it.
  bool post(scxml::Effects& effects) {
    bool posted = false;
    for (const scxml::Effect& effect : std::exchange(effects, {})) {
      const auto* send = std::get_if<scxml::OutgoingSend>(&effect);
      if (!send) continue;
      scxml::HttpPost message = scxml::to_http(*send);
      posted = true;
      const auto answer = http::send(
          send->target, {.method = "POST", .headers = {{"Content-Type", message.content_type}}, .body = message.body});
      if (answer) continue;
      const std::lock_guard lock(mutex_);
      inbox_.push_back({.name = "error.communication", .type = scxml::EventType::kPlatform, .sendid = send->sendid});
    }
    return posted;
  }

  void deliver(const scxml::Chart& chart, scxml::Session& session, TimePoint now, scxml::Effects& effects) {
    std::vector<scxml::Event> events;
    {
      const std::lock_guard lock(mutex_);
      events.swap(inbox_);
    }
    for (const scxml::Event& event : events) scxml::step(chart, session, event, now, effects, host_);
  }

  scxml::Host host_;
  std::mutex mutex_;
  std::vector<scxml::Event> inbox_;
  std::optional<http::Server> server_;
};

int run(const std::vector<std::string>& arguments) {
  bool json = false;
  std::string folder;
  std::string only;
  for (const std::string& argument : arguments) {
    if (argument == "--json")
      json = true;
    else if (argument.starts_with("--only="))
      only = argument.substr(7);
    else if (!argument.starts_with("-") && folder.empty())
      folder = argument;
    else
      folder.clear(), json = false;
  }
  if (folder.empty()) {
    std::cerr << "usage: conformance_scxml DIR [--json] [--only=ID]\n";
    return 2;
  }
  auto tests = read_manifest(folder);
  if (!tests) {
    std::cerr << to_string(tests.error()) << "\n";
    return 3;
  }
  std::int64_t passed = 0;
  List failed;
  List manual;
  Player player(folder);
  for (const Test& test : *tests) {
    if (!only.empty() && test.id != only) continue;
    if (test.manual) manual.emplace_back(test.id);
    if (test.manual && only.empty()) continue;
    const Verdict verdict = player.run(std::filesystem::path(folder) / ("test" + test.id + ".txml.scxml"));
    if (verdict.passed)
      ++passed;
    else
      failed.emplace_back(test.id);
    if (!verdict.passed || !only.empty()) std::cerr << test.id << ": " << verdict.why << "\n";
  }
  const Value report = Map{{"passed", passed}, {"failed", failed}, {"manual", manual}};
  if (json)
    std::cout << to_json(report) << "\n";
  else
    std::cout << passed << " passed, " << failed.size() << " failed, " << manual.size() << " manual\n";
  return failed.empty() ? 0 : 1;
}

}  // namespace
}  // namespace sentree

int main(int argc, char** argv) { return sentree::run({argv + 1, argv + argc}); }
