#include "sentree/yarp/address.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "sentree/rpc/address.h"

namespace sentree::yarp {
namespace {

tl::unexpected<Diagnostic> wrong(std::string_view text, std::string_view why) {
  return fail(
      "rpc.address",
      fmt::format("address \"yarp:{}\" {}; a port of YARP is yarp:/port, or yarp://host:number/port", text, why));
}

}  // namespace

std::string_view to_string(Carrier carrier) { return carrier == Carrier::kTcp ? "tcp" : "fast_tcp"; }

Result<HostPort> parse_host_port(std::string_view text) {
  HostPort out;
  const auto colon = text.rfind(':');
  if (colon != std::string_view::npos && colon > 0) {
    const std::string_view number = text.substr(colon + 1);
    const auto read = std::from_chars(number.data(), number.data() + number.size(), out.port);
    if (!number.empty() && read.ec == std::errc() && read.ptr == number.data() + number.size() && out.port != 0) {
      out.host = text.substr(0, colon);
      return out;
    }
  }
  return fail("rpc.address", fmt::format("\"{}\" is no HOST:PORT, e.g. 127.0.0.1:10000", text));
}

std::string to_string(const HostPort& at) { return fmt::format("{}:{}", at.host, at.port); }

Result<PortAddress> PortAddress::parse(std::string_view text) {
  PortAddress out;
  std::string_view rest = text;
  const std::vector<rpc::AddressOption> options = rpc::cut_options(rest);
  if (const std::string twice = rpc::given_twice(options); !twice.empty()) return wrong(text, twice);
  for (const auto& [option, value] : options) {
    if (option == "carrier=tcp" || option == "carrier=fast_tcp") {
      out.carrier = value == "tcp" ? Carrier::kTcp : Carrier::kFastTcp;
    } else if (option.starts_with("carrier=")) {
      return wrong(text,
                   fmt::format("wants the carrier \"{}\", which is not spoken here (tcp and fast_tcp are)", value));
    } else if (option == "yarp=3" || option == "yarp=4") {
      out.version = value == "3" ? Version::kYarp3 : Version::kYarp4;
    } else if (option.starts_with("server=")) {
      auto server = parse_host_port(value);
      if (!server) return wrong(text, "names its name server badly: " + server.error().message);
      out.server = std::move(*server);
    } else if (option.starts_with("listen=") && !value.empty()) {
      out.listen = value;
    } else if (option == "open") {
      out.open = true;
    } else if (option == "read") {
      out.read = true;
    } else if (option == "named") {
      out.named = true;
    } else {
      return wrong(text, fmt::format("has the unknown option \"{}\" (there is carrier=tcp|fast_tcp, yarp=3|4, "
                                     "server=HOST:PORT, read, open, named, listen=HOST)",
                                     option));
    }
  }
  if (out.read && out.open)
    return wrong(text, "is both open, which a port of ours is, and read, which one of others is");
  if (rest.starts_with("//")) {
    rest.remove_prefix(2);
    const auto slash = rest.find('/');
    auto direct = parse_host_port(rest.substr(0, slash));
    if (!direct) return wrong(text, "has a bad host: " + direct.error().message);
    out.direct = std::move(*direct);
    rest = slash == std::string_view::npos ? std::string_view("/") : rest.substr(slash);
  }
  if (rest.empty()) rest = "/";
  if (rest.front() != '/') return wrong(text, "has a name that does not begin with \"/\"");
  if (rest.size() > kNameMax) return wrong(text, fmt::format("has a name of more than {} bytes", kNameMax));
  if (std::any_of(rest.begin(), rest.end(), [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '"'; }))
    return wrong(text, "has a blank or a quote in its name");
  out.name = rest;
  return out;
}

std::string to_string(const PortAddress& address) {
  std::string out = "yarp:";
  if (!address.direct.host.empty()) out += fmt::format("//{}", to_string(address.direct));
  out += address.name;
  char mark = '?';
  const auto option = [&](const std::string& text) {
    out += mark + text;
    mark = '&';
  };
  if (address.carrier != Carrier::kTcp) option(fmt::format("carrier={}", to_string(address.carrier)));
  if (address.version == Version::kYarp4) option("yarp=4");
  if (!address.server.host.empty()) option(fmt::format("server={}", to_string(address.server)));
  if (address.listen != PortAddress().listen) option("listen=" + address.listen);
  if (address.open) option("open");
  if (address.read) option("read");
  if (address.named) option("named");
  return out;
}

bool PortAddress::is_source() const {
  if (read || name.ends_with(":o")) return !open;
  return open && name.ends_with(":i");
}

}  // namespace sentree::yarp
