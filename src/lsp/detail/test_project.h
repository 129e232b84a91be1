#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sentree/base/temporary_folder.h"
#include "sentree/base/value.h"
#include "sentree/lsp/detail/uri.h"
#include "sentree/lsp/server.h"
#include "sentree/project/plan.h"
#include "sentree/text/json.h"

namespace sentree::lsp {

/// A copy of the recharge mission, and an editor that has some of its files open.
class Editor {
 public:
  explicit Editor(Map capabilities = {}) : folder_("lsp") {
    std::filesystem::copy(project::shipped_folder("examples") / "recharge", folder(),
                          std::filesystem::copy_options::recursive);
    std::filesystem::remove_all(folder() / "runs");
    initialized =
        request("initialize",
                Map{{"processId", nullptr}, {"rootUri", uri_of(folder())}, {"capabilities", std::move(capabilities)}});
    notify("initialized", Map());
  }

  [[nodiscard]] std::filesystem::path folder() const { return folder_.path() / "project"; }
  [[nodiscard]] std::string uri(const std::string& file) const { return uri_of(folder() / file); }
  [[nodiscard]] std::string text(const std::string& file) const {
    std::ifstream in(folder() / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  void notify(const std::string& method, Map params) {
    send(Map{{"jsonrpc", "2.0"}, {"method", method}, {"params", std::move(params)}});
  }
  /// The answer: with "result" or "error".
  Value request(const std::string& method, Map params) {
    const std::int64_t id = ++requests_;
    send(Map{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", std::move(params)}});
    if (!answers.contains(id)) throw std::runtime_error("no answer to " + method);
    return answers[id];
  }
  /// Of a request about a place in a file: behind the `ahead`th byte of `word`, where it is written first.
  Value ask(const std::string& method, const std::string& file, const std::string& word, std::size_t ahead = 1,
            Map more = {}) {
    more.append("textDocument", Map{{"uri", uri(file)}});
    more.append("position", position(file, word, ahead));
    const Value answer = request("textDocument/" + method, std::move(more));
    if (answer.find("result") == nullptr) throw std::runtime_error(to_json(answer));
    return *answer.find("result");
  }
  [[nodiscard]] Map position(const std::string& file, const std::string& word, std::size_t ahead) const {
    const std::string content = texts.contains(file) ? texts.at(file) : text(file);
    const std::size_t at = content.find(word);
    if (at == std::string::npos) throw std::runtime_error(file + " has no " + word);
    std::int64_t line = 0;
    std::size_t start = 0;
    for (std::size_t i = 0; i < at + ahead; ++i) {
      if (content[i] == '\n') {
        ++line;
        start = i + 1;
      }
    }
    return Map{{"line", line}, {"character", static_cast<std::int64_t>(at + ahead - start)}};
  }

  void open(const std::string& file) { open(file, text(file)); }
  void open(const std::string& file, const std::string& content) {
    texts[file] = content;
    notify("textDocument/didOpen",
           Map{{"textDocument", Map{{"uri", uri(file)}, {"languageId", "x"}, {"version", 1}, {"text", content}}}});
  }
  /// Replaces the first `old` of a text, as typing would.
  void replace(const std::string& file, const std::string& old, const std::string& with) {
    Map range{{"start", position(file, old, 0)}, {"end", position(file, old, old.size())}};
    notify("textDocument/didChange", Map{{"textDocument", Map{{"uri", uri(file)}, {"version", 2}}},
                                         {"contentChanges", List{Map{{"range", std::move(range)}, {"text", with}}}}});
    std::string& content = texts[file];
    content.replace(content.find(old), old.size(), with);
  }
  void close(const std::string& file) {
    notify("textDocument/didClose", Map{{"textDocument", Map{{"uri", uri(file)}}}});
  }

  void send(const Value& message) {
    server.receive(to_json(message));
    work();
  }
  void work() {
    while (server.has_work()) server.work();
    for (const std::string& text : server.take_answers()) {
      Value message = *text::parse_json(text);
      if (const Value* method = message.find("method"); method != nullptr) {
        if (method->text() == "textDocument/publishDiagnostics")
          diagnostics[std::string(message.at({"params", "uri"})->text())] = *message.at({"params", "diagnostics"});
        if (method->text() == "window/showMessage") shown.emplace_back(message.at({"params", "message"})->text());
      } else if (const Value* id = message.find("id"); id != nullptr && id->as_int() != nullptr) {
        answers[*id->as_int()] = std::move(message);
      } else {
        unasked.push_back(std::move(message));
      }
    }
  }

  Server server{"test"};
  Value initialized;
  std::map<std::int64_t, Value> answers;
  List unasked;
  std::vector<std::string> shown;            // to who edits
  std::map<std::string, Value> diagnostics;  // by URI
  std::map<std::string, std::string> texts;  // that are open

 private:
  TemporaryFolder folder_;
  std::int64_t requests_ = 0;
};

}  // namespace sentree::lsp
