#include "sentree/lsp/server.h"

#include "sentree/lsp/detail/server_impl.h"

#include <fmt/format.h>

#include <exception>

#include "sentree/lsp/detail/uri.h"
#include "sentree/text/json.h"

// JSON-RPC: what arrives, in which order, and who answers it.

namespace sentree::lsp {

Server::Impl::Request Server::Impl::request(std::string_view method) {
  static const std::map<std::string_view, Request> kRequests{{"textDocument/completion", &Impl::completion},
                                                             {"textDocument/hover", &Impl::hover},
                                                             {"textDocument/definition", &Impl::definition},
                                                             {"textDocument/references", &Impl::references},
                                                             {"textDocument/documentHighlight", &Impl::highlights},
                                                             {"textDocument/prepareRename", &Impl::prepare_rename},
                                                             {"textDocument/rename", &Impl::renamed},
                                                             {"textDocument/documentSymbol", &Impl::symbols},
                                                             {"workspace/symbol", &Impl::all_symbols},
                                                             {"textDocument/formatting", &Impl::formatted},
                                                             {"textDocument/codeAction", &Impl::actions},
                                                             {"textDocument/codeLens", &Impl::lenses},
                                                             {"workspace/executeCommand", &Impl::execute}};
  const auto found = kRequests.find(method);
  return found != kRequests.end() ? found->second : nullptr;
}

void Server::Impl::notified(const std::string& method, const Value& params) {
  if (method == "initialized") return initialized();
  if (method == "textDocument/didOpen") return opened(params);
  if (method == "textDocument/didChange") return edited(params);
  if (method == "textDocument/didClose") return closed(params);
  if (method == "textDocument/didSave") {
    const auto path = path_of(text_of(member(params, "textDocument"), "uri"));
    return changed(path.value_or(fs::path()));
  }
  if (method == "workspace/didChangeWatchedFiles") return files_changed(params);
  // Others are passed over, as the protocol wants it of those that begin with $/.
}

Server::Server(std::string version) : impl_(std::make_unique<Impl>(std::move(version))) {}
Server::~Server() = default;

void Server::answer(const Value& id, Value result) {
  answers_.push_back(to_json(Value(Map{{"jsonrpc", "2.0"}, {"id", id}, {"result", std::move(result)}})));
}

void Server::answer_error(const Value& id, int code, std::string message) {
  answers_.push_back(to_json(
      Value(Map{{"jsonrpc", "2.0"}, {"id", id}, {"error", Map{{"code", code}, {"message", std::move(message)}}}})));
}

void Server::refuse(const std::string& problem) { answer_error({}, kParseError, problem); }

void Server::receive(std::string_view content) {
  auto message = text::parse_json(content);
  if (!message) return answer_error({}, kParseError, "that is no JSON: " + message.error().message);
  const Value* const id = message->find("id");
  const Value* const method = message->find("method");
  const bool is_id = id != nullptr && (id->as_int() != nullptr || id->as_string() != nullptr);
  if (message->as_map() == nullptr || (id != nullptr && !is_id && !id->is_null()) ||
      (method != nullptr && method->as_string() == nullptr) ||
      (method == nullptr && message->find("result") == nullptr && message->find("error") == nullptr))
    return answer_error(is_id ? *id : Value(), kInvalidRequest,
                        "a message is a request or a notification of JSON-RPC 2.0");
  if (method == nullptr) return;  // the answer to a request of ours, of which nothing follows
  Waiting waiting;
  waiting.is_request = is_id;
  if (is_id) waiting.id = *id;
  waiting.method = *method->as_string();
  if (Value* params = message->as_map()->find("params")) waiting.params = std::move(*params);
  if (waiting.method == "$/cancelRequest") {
    const Value& cancelled = member(waiting.params, "id");
    for (Waiting& other : waiting_)
      other.is_cancelled = other.is_cancelled || (other.is_request && other.id == cancelled);
    return;
  }
  if (waiting.is_request && !has_room())
    return answer_error(waiting.id, kServerCancelled, fmt::format("more than {} requests wait", kWaitingMax));
  waiting_.push_back(std::move(waiting));
}

bool Server::has_work() const { return !is_over_ && (!waiting_.empty() || impl_->unchecked() != nullptr); }

void Server::work() {
  if (!waiting_.empty()) {
    Waiting message = std::move(waiting_.front());
    waiting_.pop_front();
    handle(message);
  } else if (Impl::Project* const project = impl_->unchecked()) {
    try {
      impl_->check(*project);
    } catch (const std::exception& error) {
      impl_->note("window/logMessage", Map{{"type", 1}, {"message", std::string("checking failed: ") + error.what()}});
    }
  }
  for (std::string& note : impl_->notes) answers_.push_back(std::move(note));
  impl_->notes.clear();
}

void Server::handle(Waiting& message) {
  const auto refuse_request = [&](int code, std::string why) {
    if (message.is_request) answer_error(message.id, code, std::move(why));
  };
  if (message.is_cancelled) return refuse_request(kRequestCancelled, "cancelled");
  if (message.method == "exit") {
    is_over_ = true;
    return;
  }
  if (message.method != "initialize" && !is_initialized_)
    return refuse_request(kServerNotInitialized, "the first request is \"initialize\"");
  if (is_shut_down_) return refuse_request(kInvalidRequest, "the server has been shut down");
  try {
    if (message.method == "initialize") {
      if (is_initialized_) return refuse_request(kInvalidRequest, "it has been initialized");
      if (!message.is_request) return;
      Value result = impl_->initialize(message.params);
      is_initialized_ = true;
      return answer(message.id, std::move(result));
    }
    if (message.method == "shutdown") {
      is_shut_down_ = message.is_request;
      if (message.is_request) answer(message.id, {});
      return;
    }
    if (!message.is_request) return impl_->notified(message.method, message.params);
    const auto request = Impl::request(message.method);
    if (request == nullptr)
      return refuse_request(kMethodNotFound, fmt::format("there is no request \"{}\"", message.method));
    answer(message.id, (impl_.get()->*request)(message.params));
  } catch (const Refusal& refusal) {
    refuse_request(refusal.code, refusal.message);
  } catch (const std::exception& error) {
    refuse_request(kInternalError, std::string("the request failed: ") + error.what());
  }
}

std::vector<std::string> Server::take_answers() { return std::exchange(answers_, {}); }

}  // namespace sentree::lsp
