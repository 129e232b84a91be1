#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "sentree/yarp/names.h"

namespace sentree::yarp {

/// Keeps ports known to a name server, from a thread of its own: one that is started anew has forgotten them.
class Registrar {
 public:
  /// @param period  Between two looks.
  Registrar(HostPort server, std::function<void(const std::string&)> problem,
            std::chrono::milliseconds period = std::chrono::seconds(2));
  ~Registrar();
  Registrar(const Registrar&) = delete;
  Registrar& operator=(const Registrar&) = delete;

  /// Makes the port known at once, and from then on. Error: yarp.no-name-server.
  [[nodiscard]] Result<void> add(const std::string& name, const HostPort& at);
  /// In the registrar's thread, at each look.
  void also(std::function<void(NameClient&)> work);
  /// Takes all ports off the list. Idempotent.
  void stop();

 private:
  void run();

  struct Entry {
    std::string name;
    HostPort at;
    bool taken = false;  // by another
    bool told = false;   // that it is, or that there is no name server
  };

  const HostPort server_;
  const std::function<void(const std::string&)> problem_;
  const std::chrono::milliseconds period_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Entry> entries_;
  std::function<void(NameClient&)> also_;
  bool stopping_ = false;
  bool poked_ = false;  // there is something to do before the period is over
  std::thread thread_;
};

}  // namespace sentree::yarp
