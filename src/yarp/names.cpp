#include "sentree/yarp/names.h"

#include <fmt/format.h>

#include <unistd.h>

#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "sentree/yarp/detail/inbox.h"

namespace sentree::yarp {
namespace {

constexpr std::size_t kAnswerLineMax = 8192;
constexpr std::size_t kAnswerMax = 64U << 20U;
constexpr std::string_view kEnd = "*** end of message";

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::optional<HostPort> from_file(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string host;
  std::string port;
  if (!(in >> host >> port)) return std::nullopt;
  auto parsed = parse_host_port(fmt::format("{}:{}", host, port));
  if (!parsed) return std::nullopt;
  return std::move(*parsed);
}

std::filesystem::path config_file() {
  std::filesystem::path folder = variable("YARP_CONFIG_HOME");
  if (folder.empty() && !variable("XDG_CONFIG_HOME").empty())
    folder = std::filesystem::path(variable("XDG_CONFIG_HOME")) / "yarp";
  if (folder.empty()) folder = std::filesystem::path(variable("HOME")) / ".config" / "yarp";
  return folder / "yarp.conf";
}

}  // namespace

HostPort configured_name_server() {
  if (auto given = parse_host_port(variable("SENTREE_YARP_SERVER"))) return std::move(*given);
  return from_file(config_file()).value_or(HostPort{"127.0.0.1", 10000});
}

Result<void> check_name_server() {
  if (const std::string given = variable("SENTREE_YARP_SERVER"); !given.empty()) {
    if (parse_host_port(given)) return {};
    return fail(
        "yarp.environment",
        fmt::format("SENTREE_YARP_SERVER=\"{}\" is no HOST:PORT of a name server, e.g. 127.0.0.1:10000; set it so, "
                    "unset it, or write ?server=HOST:PORT behind the address",
                    given));
  }
  const std::filesystem::path file = config_file();
  std::ifstream in(file);
  std::string word;
  if (!(in >> word) || from_file(file)) return {};
  return fail(
      "yarp.environment",
      fmt::format("{} does not begin with HOST PORT of a name server, as yarp conf HOST PORT writes it; write it "
                  "anew, set SENTREE_YARP_SERVER=HOST:PORT, or write ?server=HOST:PORT behind the address",
                  file.string()));
}

std::optional<Registration> parse_registration(std::string_view line) {
  std::istringstream words{std::string(line)};
  std::string word;
  if (!(words >> word) || word != "registration") return std::nullopt;
  Registration out;
  std::string key;
  std::string value;
  while (words >> key >> value) {
    if (key == "name") out.name = value;
    if (key == "ip") out.at.host = value;
    if (key == "type") out.carrier = value;
    if (key != "port") continue;
    const auto read = std::from_chars(value.data(), value.data() + value.size(), out.at.port);
    if (read.ec != std::errc()) return std::nullopt;
  }
  if (out.name.empty()) return std::nullopt;
  return out;
}

std::string to_line(const Registration& r) {
  return fmt::format("registration name {} ip {} port {} type {}", r.name, r.at.host, r.at.port, r.carrier);
}

tl::unexpected<Diagnostic> NameClient::no_server(const std::string& why) const {
  return fail("yarp.no-name-server",
              fmt::format("no name server of YARP answers at {} ({}); start yarpserver, or sentree run --yarp-server; "
                          "another place is named by yarp conf HOST PORT, SENTREE_YARP_SERVER or ?server=HOST:PORT",
                          to_string(server_), why));
}

Result<std::vector<std::string>> NameClient::ask(const std::vector<std::string>& words, rpc::Deadline deadline) {
  rpc::Address at;
  at.kind = rpc::Address::Kind::kTcp;
  at.host = server_.host;
  at.port = server_.port;
  rpc::Connected made = rpc::connect_to(at, resolver_, nullptr, deadline);
  if (made.stream == nullptr) return no_server(made.why);
  std::string request = "NAME_SERVER";
  for (const std::string& word : words) request += " " + word;
  request += "\r\n";
  if (made.stream->send(reinterpret_cast<const std::uint8_t*>(request.data()), request.size(), deadline) !=
      rpc::StreamStatus::kOk)
    return no_server(made.stream->why());
  std::vector<std::string> lines;
  try {
    Inbox in(made.stream.get(), kAnswerMax);
    in.begin(deadline);
    while (lines.size() < kRegistrationsMax) {
      std::string line = in.line(kAnswerLineMax);
      if (line == kEnd) return lines;
      lines.push_back(std::move(line));
      // These two have no end.
      if (words.front() == "announce" || words.front() == "bot") return lines;
    }
  } catch (const Broken& e) {
    return no_server(e.why);
  }
  return no_server(fmt::format("its answer has more than {} lines", kRegistrationsMax));
}

Result<std::optional<Registration>> NameClient::query(const std::string& name, rpc::Deadline deadline) {
  auto lines = ask({"query", name}, deadline);
  if (!lines) return tl::unexpected(std::move(lines.error()));
  for (const std::string& line : *lines) {
    if (auto found = parse_registration(line); found && found->name == name) return found;
  }
  return std::optional<Registration>();
}

Result<std::vector<Registration>> NameClient::list(rpc::Deadline deadline) {
  auto lines = ask({"list"}, deadline);
  if (!lines) return tl::unexpected(std::move(lines.error()));
  std::vector<Registration> out;
  for (const std::string& line : *lines) {
    if (auto found = parse_registration(line)) out.push_back(std::move(*found));
  }
  return out;
}

Result<Registration> NameClient::enter(const std::string& name, const HostPort& at, rpc::Deadline deadline) {
  auto lines = ask({"register", name, "tcp", at.host, std::to_string(at.port)}, deadline);
  if (!lines) return tl::unexpected(std::move(lines.error()));
  const auto made = lines->empty() ? std::nullopt : parse_registration(lines->front());
  if (!made) return no_server("it does not register " + name);
  // As ports of YARP do when they open. Whoever knows nothing of this has registered the port all the same.
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{"set", made->name, "offers", "tcp", "fast_tcp", "text", "text_ack"},
                                             {"set", made->name, "accepts", "tcp", "fast_tcp", "text", "text_ack"},
                                             {"set", made->name, "ips", at.host},
                                             {"set", made->name, "process", std::to_string(::getpid())},
                                             {"announce", made->name}}) {
    if (auto told = ask(more, deadline); !told) return tl::unexpected(std::move(told.error()));
  }
  return *made;
}

Result<void> NameClient::remove(const std::string& name, rpc::Deadline deadline) {
  auto lines = ask({"unregister", name}, deadline);
  if (!lines) return tl::unexpected(std::move(lines.error()));
  return {};
}

}  // namespace sentree::yarp
