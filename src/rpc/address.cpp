#include "sentree/rpc/address.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "sentree/rpc/middleware.h"

namespace sentree::rpc {
namespace {

tl::unexpected<Diagnostic> wrong(std::string_view text, std::string_view why) {
  return fail("rpc.address", fmt::format("address \"{}\" {}; an address is {}", text, why, address_forms()));
}

bool set_option(std::string_view option, Address& out) {
  if (option == "protocol=compact") return out.protocol = Address::Protocol::kCompact, true;
  if (option == "protocol=binary") return out.protocol = Address::Protocol::kBinary, true;
  if (option == "transport=framed") return out.framed = true, true;
  if (option == "transport=buffered") return out.framed = false, true;
  return false;
}

// The longest path that a Unix socket's address holds, its ending NUL left out.
constexpr std::size_t kSocketPathMax = 107;

}  // namespace

Result<Address> Address::parse(std::string_view text) {
  Address out;
  std::string_view rest = text;
  const std::string_view scheme = text.substr(0, std::min(text.find(':'), text.size()));
  if (const Middleware* other = find_middleware(scheme); other != nullptr && other != &thrift()) {
    if (scheme.size() == text.size()) return wrong(text, "has no \":\" after its scheme");
    out.kind = Kind::kOther;
    out.scheme = scheme;
    out.path = text.substr(scheme.size() + 1);
    if (auto known = other->check(out); !known) return tl::unexpected(std::move(known.error()));
    return out;
  }
  const std::vector<AddressOption> options = cut_options(rest);
  if (const std::string twice = given_twice(options); !twice.empty()) return wrong(text, twice);
  for (const AddressOption& option : options) {
    if (!set_option(option.text, out)) {
      return wrong(
          text,
          fmt::format("has the unknown option \"{}\" (there is protocol=binary|compact, transport=buffered|framed)",
                      option.text));
    }
  }
  if (rest.starts_with("local:") || rest.starts_with("unix:")) {
    const bool local = rest.starts_with("local:");
    out.kind = local ? Kind::kLocal : Kind::kUnix;
    rest.remove_prefix(rest.find(':') + 1);
    const auto hash = rest.find('#');
    if (hash != std::string_view::npos) {
      out.service = rest.substr(hash + 1);
      if (out.service.empty()) return wrong(text, "has no service after \"#\"");
    }
    out.path = rest.substr(0, hash);
    if (out.path.empty()) return wrong(text, local ? "has no name" : "has no path");
    if (!local && out.path.size() > kSocketPathMax) {
      return wrong(text, fmt::format("has a path of more than {} bytes, which no socket can have", kSocketPathMax));
    }
    if (out.path.find('\0') != std::string::npos) return wrong(text, "has a NUL in its path");
    return out;
  }
  if (!rest.starts_with("tcp://") && !rest.starts_with("tls://"))
    return wrong(text, "begins with none of the known schemes");
  out.kind = rest.starts_with("tcp://") ? Kind::kTcp : Kind::kTls;
  rest.remove_prefix(6);
  if (const auto slash = rest.find('/'); slash != std::string_view::npos) {
    out.service = rest.substr(slash + 1);
    rest = rest.substr(0, slash);
  }
  const auto colon = rest.rfind(':');
  const bool bracketed = rest.starts_with('[');
  const auto bracket = rest.find(']');
  if (bracketed && (bracket == std::string_view::npos || bracket + 1 != colon)) return wrong(text, "needs [host]:port");
  if (colon == std::string_view::npos) return wrong(text, "has no port");
  const std::string_view port = rest.substr(colon + 1);
  out.host = bracketed ? rest.substr(1, bracket - 1) : rest.substr(0, colon);
  if (out.host.empty()) return wrong(text, "has no host");
  if (!bracketed && out.host.find(':') != std::string::npos)
    return wrong(text, "has colons in its host; write IPv6 in brackets");
  const auto read = std::from_chars(port.data(), port.data() + port.size(), out.port);
  if (port.empty() || read.ec != std::errc() || read.ptr != port.data() + port.size()) {
    return wrong(text, fmt::format("has the port \"{}\", which is no number from 0 to 65535", port));
  }
  return out;
}

std::vector<AddressOption> cut_options(std::string_view& address) {
  std::vector<AddressOption> out;
  const auto question = address.find('?');
  if (question == std::string_view::npos) return out;
  std::string_view rest = address.substr(question + 1);
  address = address.substr(0, question);
  while (!rest.empty()) {
    const std::string_view text = rest.substr(0, rest.find('&'));
    out.push_back({text, text.substr(std::min(text.find('='), text.size() - 1) + 1)});
    rest.remove_prefix(std::min(text.size() + 1, rest.size()));
  }
  return out;
}

std::string given_twice(const std::vector<AddressOption>& options) {
  const auto name = [](const AddressOption& option) { return option.text.substr(0, option.text.find('=')); };
  for (auto one = options.begin(); one != options.end(); ++one) {
    const auto again = std::find_if(options.begin(), one, [&](const auto& other) { return name(other) == name(*one); });
    if (again != one) return fmt::format("gives {} twice: {} and {}", name(*one), again->text, one->text);
  }
  return {};
}

std::string to_string(const Address& address) {
  std::string out;
  switch (address.kind) {
    case Address::Kind::kOther: return fmt::format("{}:{}", address.scheme, address.path);
    case Address::Kind::kLocal: out = "local:" + address.path; break;
    case Address::Kind::kUnix: out = "unix:" + address.path; break;
    case Address::Kind::kTcp:
    case Address::Kind::kTls: {
      const bool ipv6 = address.host.find(':') != std::string::npos;
      out = address.kind == Address::Kind::kTcp ? "tcp://" : "tls://";
      out += fmt::format("{}:{}", ipv6 ? fmt::format("[{}]", address.host) : address.host, address.port);
      break;
    }
  }
  if (!address.service.empty()) {
    const bool socket = address.kind == Address::Kind::kTcp || address.kind == Address::Kind::kTls;
    out += (socket ? "/" : "#") + address.service;
  }
  char mark = '?';
  if (address.protocol == Address::Protocol::kCompact) {
    out += "?protocol=compact";
    mark = '&';
  }
  if (address.framed) {
    out += mark;
    out += "transport=framed";
  }
  return out;
}

}  // namespace sentree::rpc
