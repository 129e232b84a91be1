#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sentree/rpc/client.h"
#include "sentree/rpc/line.h"
#include "sentree/yarp/address.h"
#include "sentree/yarp/detail/encoding.h"
#include "sentree/yarp/names.h"

/// The client's side of a port. Private to the library.
namespace sentree::yarp {

/// Messages have no numbers: one call at a time. After a deadline, or a reply that cannot be read, the connection is
/// given up, because what comes next on it could belong to anything.
class PortLine final : public rpc::Line {
 public:
  /// @param data  Method whose name is left out, for ports of data; null: calls.
  PortLine(PortAddress address, const idl::Service& interface, rpc::ClientOptions options, const idl::Method* data);

  [[nodiscard]] tl::expected<void, rpc::CallError> open(rpc::Deadline deadline) override { return connected(deadline); }
  [[nodiscard]] std::optional<rpc::Outcome> send(const idl::Method& method, const Value& arguments,
                                                 rpc::Deadline deadline) override;
  [[nodiscard]] rpc::Outcome receive(const idl::Method& method, rpc::Deadline deadline) override;
  [[nodiscard]] std::shared_ptr<rpc::Link> prepare(const idl::Method& method, const Value& arguments) override;
  [[nodiscard]] std::optional<rpc::Outcome> send_rest(std::size_t sent, rpc::Deadline deadline) override;
  void take_late_replies() override;
  [[nodiscard]] bool owes() const override { return acknowledgements_owed_ > 0; }
  [[nodiscard]] rpc::Deadline gives_up() const override { return rpc::kNoDeadline; }
  void drop() override;
  [[nodiscard]] std::shared_ptr<rpc::Link> connection() const override;
  void begin() override;
  void interrupt(bool for_good) override;
  [[nodiscard]] Counts counts() const override;
  [[nodiscard]] rpc::CallError unreachable(const std::string& why) const override;
  [[nodiscard]] rpc::CallError late(const std::string& what) const override;

 private:
  struct Connection;

  [[nodiscard]] tl::expected<void, rpc::CallError> connected(rpc::Deadline deadline);
  [[nodiscard]] tl::expected<void, rpc::CallError> connect(rpc::Deadline deadline);
  void write(const idl::Method& method, const Value& arguments);
  [[nodiscard]] std::optional<rpc::Outcome> transmit(std::size_t from, rpc::Deadline deadline);
  void take_acknowledgements(rpc::Deadline deadline);
  [[nodiscard]] std::string where() const;
  /// "; did you mean …?" of the ports that the name server knows.
  [[nodiscard]] std::string near_port(rpc::Deadline deadline);

  const PortAddress address_;
  const rpc::ClientOptions options_;
  const idl::Method* const data_;
  const Encoding encoding_;
  std::map<const idl::Method*, std::string> refused_;  // and why
  NameClient names_;
  rpc::Resolver resolver_;

  mutable std::mutex mutex_;  // of what `interrupt` and `counts` look at
  bool closed_ = false;
  bool interrupted_ = false;
  std::shared_ptr<Connection> connection_;
  Counts counts_;

  std::size_t acknowledgements_owed_ = 0;
  bool oneway_ = false;  // what was sent last
  int failures_ = 0;
  rpc::Deadline next_attempt_{};
  std::string last_failure_;
  std::string near_;  // port, of a name that nobody has
};

}  // namespace sentree::yarp
