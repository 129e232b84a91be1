#include "sentree/ros/address.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>

#include "sentree/rpc/address.h"

namespace sentree::ros {
namespace {

// Beyond it, the ports of UDP are those that the kernel gives to others.
constexpr std::uint32_t kDomainMax = 232;

tl::unexpected<Diagnostic> wrong_address(std::string_view text, std::string_view why) {
  return fail(
      "rpc.address",
      fmt::format(
          "address \"ros:{}\" {}; a name of ROS 2 is ros:/name, as ros2 topic list or ros2 service list shows it", text,
          why));
}

std::optional<std::uint32_t> domain_number(std::string_view text) {
  std::uint32_t out = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), out);
  if (text.empty() || read.ec != std::errc() || read.ptr != text.data() + text.size() || out > kDomainMax)
    return std::nullopt;
  return out;
}

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::vector<std::string> hosts_in(std::string_view text, char between) {
  std::vector<std::string> out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(between), text.size());
    const std::string_view host = text.substr(0, end);
    if (!host.empty()) out.emplace_back(host);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

std::optional<Release> release_named(std::string_view name) {
  if (name == "humble") return Release::kHumble;
  for (const char* const later : {"iron", "jazzy", "kilted", "lyrical", "rolling"}) {
    if (name == later) return Release::kIron;
  }
  return std::nullopt;
}

bool is_name(std::string_view name) {
  if (name.empty() || name.front() != '/' || name.size() > 240) return false;
  char before = 0;
  for (const char c : name) {
    const bool is_digit = c >= '0' && c <= '9';
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    if (c == '/' ? before == '/' : !is_letter && !is_digit) return false;
    if (is_digit && before == '/') return false;
    before = c;
  }
  return true;
}

}  // namespace

Result<GraphAddress> GraphAddress::parse(std::string_view text) {
  GraphAddress out;
  std::string_view rest = text;
  const std::vector<rpc::AddressOption> options = rpc::cut_options(rest);
  if (const std::string twice = rpc::given_twice(options); !twice.empty()) return wrong_address(text, twice);
  for (const auto& [option, value] : options) {
    if (option == "publish") {
      out.publish = true;
    } else if (option == "requests") {
      out.requests = true;
    } else if (option == "qos=default" || option == "qos=sensor_data" || option == "qos=transient_local" ||
               option == "qos=best_effort") {
      out.qos = value;
    } else if (option.starts_with("domain=")) {
      out.domain = domain_number(value);
      if (!out.domain)
        return wrong_address(text, fmt::format("has a domain that is no number from 0 to {}", kDomainMax));
    } else if (option == "range=localhost" || option == "range=subnet") {
      out.localhost = value == "localhost";
    } else if (option.starts_with("peers=")) {
      out.peers = hosts_in(value, ',');
      if (out.peers.empty()) return wrong_address(text, "has peers= without a host");
      if (value.find(';') != std::string_view::npos)
        return wrong_address(text, "has a semicolon between its peers, where a comma is meant");
    } else if (option.starts_with("release=")) {
      out.release = release_named(value);
      if (!out.release)
        return wrong_address(text, fmt::format("names the release \"{}\", which is not known here", value));
    } else {
      return wrong_address(text, fmt::format("has the unknown option \"{}\" (there is publish, requests, "
                                             "qos=default|sensor_data|transient_local|best_effort, domain=N, "
                                             "range=localhost|subnet, peers=HOST,HOST, "
                                             "release=humble|iron|jazzy|kilted)",
                                             option));
    }
  }
  if (rest.empty()) rest = "/";
  if (!is_name(rest)) {
    return wrong_address(
        text,
        "has a name that cannot be one: it begins with a slash, and its parts have letters, digits and "
        "underscores and begin with no digit");
  }
  out.name = rest;
  return out;
}

dds::Qos GraphAddress::qos_of(bool writes) const {
  if (qos == "sensor_data") return {.reliable = false, .transient_local = false, .depth = 5};
  if (qos == "transient_local") return {.reliable = true, .transient_local = true, .depth = 1};
  if (qos == "best_effort") return {.reliable = false};
  // A reader that asks for less than is offered gets it all the same, one that asks for more gets nothing.
  if (qos.empty() && !writes) return {.reliable = false};
  return {};
}

Result<void> GraphAddress::check_environment() const {
  const std::string number = environment("ROS_DOMAIN_ID");
  if (!domain && !number.empty() && !domain_number(number)) {
    return fail("ros.environment",
                fmt::format("ROS_DOMAIN_ID=\"{}\" is no number from 0 to {}; unset it for domain 0, or write domain=N "
                            "behind the address",
                            number, kDomainMax));
  }
  const std::string hosts = environment("ROS_STATIC_PEERS");
  if (peers.empty() && hosts.find_first_of(", \t") != std::string::npos) {
    return fail("ros.environment",
                fmt::format("ROS_STATIC_PEERS=\"{}\" has hosts with something other than a semicolon between them; "
                            "write HOST;HOST, or peers=HOST,HOST behind the address",
                            hosts));
  }
  const std::string range = environment("ROS_AUTOMATIC_DISCOVERY_RANGE");
  const std::string only = environment("ROS_LOCALHOST_ONLY");
  if (!localhost && range.empty() && !only.empty() && only != "0" && only != "1") {
    return fail("ros.environment",
                fmt::format("ROS_LOCALHOST_ONLY=\"{}\" is neither 0 nor 1; set it to one of them, or write "
                            "range=localhost or range=subnet behind the address",
                            only));
  }
  if (localhost || range.empty() || range == "SUBNET" || range == "LOCALHOST" || range == "SYSTEM_DEFAULT") return {};
  if (range == "OFF") {
    return fail("ros.environment",
                "ROS_AUTOMATIC_DISCOVERY_RANGE=OFF: no node is to find another one, so nobody could be reached; set it "
                "to LOCALHOST or SUBNET, or write range=localhost behind the address");
  }
  return fail("ros.environment",
              fmt::format("ROS_AUTOMATIC_DISCOVERY_RANGE=\"{}\" is none of LOCALHOST, SUBNET, OFF and SYSTEM_DEFAULT; "
                          "set it to one of them, or write range=localhost or range=subnet behind the address",
                          range));
}

std::string oddities_of_environment() {
  std::string out;
  const std::string distro = environment("ROS_DISTRO");
  if (!distro.empty() && !release_named(distro)) {
    out += fmt::format(
        "; ROS_DISTRO=\"{}\" is no release that is known here, and Humble is taken: write release= behind the address",
        distro);
  }
  const std::string rmw = environment("RMW_IMPLEMENTATION");
  const bool is_dds = rmw.find("fastrtps") != std::string::npos || rmw.find("dds") != std::string::npos;
  if (!rmw.empty() && !is_dds) {
    out += fmt::format(
        "; RMW_IMPLEMENTATION=\"{}\" is not by DDS: nodes that use it are not found; let them use "
        "rmw_fastrtps_cpp or rmw_cyclonedds_cpp",
        rmw);
  }
  return out;
}

std::uint32_t GraphAddress::domain_or_environment() const {
  return domain ? *domain : domain_number(environment("ROS_DOMAIN_ID")).value_or(0);
}

bool GraphAddress::localhost_or_environment() const {
  if (localhost) return *localhost;
  const std::string range = environment("ROS_AUTOMATIC_DISCOVERY_RANGE");
  return !(range == "SUBNET" || (range.empty() && environment("ROS_LOCALHOST_ONLY") == "0"));
}

std::vector<std::string> GraphAddress::peers_or_environment() const {
  return peers.empty() ? hosts_in(environment("ROS_STATIC_PEERS"), ';') : peers;
}

Release GraphAddress::release_or_environment() const {
  return release ? *release : release_named(environment("ROS_DISTRO")).value_or(Release::kHumble);
}

}  // namespace sentree::ros
