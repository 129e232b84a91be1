// A client in C++ with code that the Thrift compiler generates: asks a battery, wherever it is served, and prints its
// charge. ask_battery HOST PORT [SERVICE], or ask_battery SOCKET [SERVICE]; a server of several services is asked for
// one by its name. See docs/how-to/component-in-another-language.md.

#include <thrift/protocol/TBinaryProtocol.h>
#include <thrift/protocol/TMultiplexedProtocol.h>
#include <thrift/transport/TBufferTransports.h>
#include <thrift/transport/TSocket.h>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>

#include "Battery.h"

namespace thrift = apache::thrift;

int main(int argc, char** argv) try {
  const bool unix_socket = argc > 1 && std::string(argv[1]).find('/') != std::string::npos;
  const int first = unix_socket ? 2 : 3;  // what follows the address
  if (argc < first || argc > first + 1) {
    std::cerr << "usage: ask_battery HOST PORT [SERVICE], or ask_battery SOCKET [SERVICE]\n";
    return 2;
  }
  const auto socket = unix_socket ? std::make_shared<thrift::transport::TSocket>(argv[1])
                                  : std::make_shared<thrift::transport::TSocket>(argv[1], std::atoi(argv[2]));
  const auto transport = std::make_shared<thrift::transport::TBufferedTransport>(socket);
  std::shared_ptr<thrift::protocol::TProtocol> protocol =
      std::make_shared<thrift::protocol::TBinaryProtocol>(transport);
  if (argc > first) protocol = std::make_shared<thrift::protocol::TMultiplexedProtocol>(protocol, argv[first]);
  transport->open();
  robot::BatteryState state;
  robot::BatteryClient(protocol).getBatteryState(state);
  std::cout << state.percentage << " " << state.header.frame_id << "\n";
  transport->close();
} catch (const thrift::TException& problem) {
  std::cerr << problem.what() << "\n";
  return 1;
}
