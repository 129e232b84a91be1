#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sentree/idl/schema.h"
#include "sentree/mission/delivery.h"
#include "sentree/runtime/open_page.h"

namespace sentree::runtime {

class Tap;

/// What a run does for those who connect to its control socket. Called from the server's threads.
struct ControlHandler {
  std::function<std::string()> scenario;
  std::function<TimePoint()> now;
  /// Name, interface and service.
  struct ServiceEntry {
    std::string name;
    idl::ServicePtr service;
    std::string at;  ///< "sim" or an address; several joined by ", ".
  };
  std::function<std::vector<ServiceEntry>()> services;
  std::function<mission::CallOutcome(const std::string& service, const std::string& method, const Value& arguments)>
      call;
  Tap* tap = nullptr;       ///< Borrowed.
  OpenPage open_page = {};  ///< Null: there is no page.
};

}  // namespace sentree::runtime
