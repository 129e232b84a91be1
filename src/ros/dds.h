#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

/// What is used of DDS, in octets. The implementation is a shared object that is loaded when the first address of ROS
/// is opened (`load_dds`), so that nobody else pays for it; this header is all that the two sides share.
namespace sentree::ros::dds {

/// Of a reader, a writer or a participant; the first two octets tell the implementation.
using Guid = std::array<std::uint8_t, 16>;

/// Of Cyclone DDS, which `rmw_cyclonedds` has.
[[nodiscard]] inline bool is_cyclone(const Guid& guid) { return guid[0] == 0x01 && guid[1] == 0x10; }

/// Which sample, by who wrote it.
struct SampleId {
  Guid writer{};
  std::int64_t sequence = -1;

  [[nodiscard]] bool is_known() const { return writer != Guid{}; }
};

struct Sample {
  std::vector<std::uint8_t> octets;  ///< With the encapsulation.
  SampleId id;
  SampleId related;  ///< What a request or a reply refers to; unknown: nothing.
};

struct Qos {
  bool reliable = true;
  bool transient_local = false;  ///< Who comes late gets the last `depth`.
  int depth = 10;
};

struct Channel {
  std::string topic;
  std::string type;
  Qos qos;
  std::string user_data = {};
};

/// What a reader of requests says of itself that only listens, and the writer beside it that says nothing.
inline constexpr std::string_view kOverhears = "sentree=overhears;";

/// A reader or a writer of somebody else, as discovered.
struct Endpoint {
  Guid guid{};
  bool is_writer = false;
  std::string topic;
  std::string type;
  bool overhears = false;  ///< By its user data.
  bool transient_local = false;
};

/// Goes when it is destroyed; then none of its functions is called any more, and none is in progress.
class Reader {
 public:
  virtual ~Reader() = default;
  [[nodiscard]] virtual Guid guid() const = 0;
  [[nodiscard]] virtual std::vector<Guid> matched() const = 0;  ///< Writers, but for those that only stand there.
};

class Writer {
 public:
  virtual ~Writer() = default;
  [[nodiscard]] virtual Guid guid() const = 0;
  /// Readers that get whatever is written from now on, but for those that overhear.
  [[nodiscard]] virtual std::vector<Guid> matched() const = 0;
  /// @returns the sample's number, or 0: the queues are full, or the memory.
  [[nodiscard]] virtual std::int64_t write(const std::vector<std::uint8_t>& octets, const SampleId* related) = 0;
  /// Waits a moment until readers have what was written.
  virtual void flush() = 0;
};

class Participant {
 public:
  /// From a thread of DDS, which must not be kept long, nor may anything be opened or closed in it.
  using OnSample = std::function<void(Sample)>;
  /// Somebody has come or gone; or why somebody who is there does not fit.
  using OnChange = std::function<void(const std::string& misfit)>;

  virtual ~Participant() = default;
  [[nodiscard]] virtual Guid guid() const = 0;
  /// Null: `error` says why.
  [[nodiscard]] virtual std::unique_ptr<Reader> read(const Channel& channel, OnSample on_sample, OnChange on_change,
                                                     std::string& error) = 0;
  [[nodiscard]] virtual std::unique_ptr<Writer> write(const Channel& channel, OnChange on_change,
                                                      std::string& error) = 0;
  /// Of all other participants.
  [[nodiscard]] virtual std::vector<Endpoint> endpoints() const = 0;
};

struct ParticipantOptions {
  std::uint32_t domain = 0;
  /// Only who is on this machine; else who is on the network, by multicast.
  bool localhost = true;
  /// Hosts whose participants are looked for besides, by name or address. With any, all interfaces are listened on.
  std::vector<std::string> peers;
  std::string enclave = "/";

  friend auto operator<=>(const ParticipantOptions&, const ParticipantOptions&) = default;
};

/// The one function of the shared object, "sentree_ros_dds". Null: `error` says why.
using Open = Participant* (*)(const ParticipantOptions& options, std::string& error);
inline constexpr const char* kOpenName = "sentree_ros_dds_4";

}  // namespace sentree::ros::dds
