// The shared object that carries octets over Fast DDS 2. It knows nothing of Sentree but `ros/dds.h`.

#include <fmt/format.h>

#include <fastdds/rtps/transport/ChainingTransport.h>
#include <fastdds/rtps/transport/ChainingTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/log/Log.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <map>
#include <mutex>
#include <set>

#include "sentree/ros/dds.h"

namespace sentree::ros::dds {
namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::types::ReturnCode_t;

// The library's own 3 s keep a sample from a reader that was matched a moment later.
constexpr std::uint32_t kHeartbeatNs = 200'000'000;
constexpr std::uint32_t kLocalPeersMax = 20;
constexpr std::int32_t kFlushS = 1;

Guid guid_of(const rtps::GUID_t& guid) {
  Guid out;
  std::memcpy(out.data(), guid.guidPrefix.value, 12);
  std::memcpy(out.data() + 12, guid.entityId.value, 4);
  return out;
}

rtps::GUID_t guid_of(const Guid& guid) {
  rtps::GUID_t out;
  std::memcpy(out.guidPrefix.value, guid.data(), 12);
  std::memcpy(out.entityId.value, guid.data() + 12, 4);
  return out;
}

SampleId sample_id(const rtps::SampleIdentity& id) {
  if (id.writer_guid() == rtps::GUID_t::unknown()) return {};
  return {guid_of(id.writer_guid()), static_cast<std::int64_t>(id.sequence_number().to64long())};
}

using Octets = std::vector<std::uint8_t>;

// A type whose samples are octets already.
class OctetsType final : public fast::TopicDataType {
 public:
  explicit OctetsType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 512;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* data, rtps::SerializedPayload_t* payload) override {
    const auto& octets = *static_cast<const Octets*>(data);
    if (octets.size() > payload->max_size) return false;
    std::memcpy(payload->data, octets.data(), octets.size());
    payload->length = static_cast<std::uint32_t>(octets.size());
    payload->encapsulation = CDR_LE;
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Octets*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<const Octets*>(data)->size()); };
  }
  void* createData() override { return new Octets; }
  void deleteData(void* data) override { delete static_cast<Octets*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
  bool is_bounded() const override { return false; }
  bool is_plain() const override { return false; }
};

// "/chatter" of "rt/chatter".
std::string shown_topic(const std::string& topic) { return topic.substr(std::min(topic.find('/'), topic.size())); }

std::string misfit_text(const std::string& topic, fast::QosPolicyId_t policy, bool is_writer) {
  const char* what = policy == fast::RELIABILITY_QOS_POLICY_ID  ? "reliability"
                     : policy == fast::DURABILITY_QOS_POLICY_ID ? "durability"
                     : policy == fast::DEADLINE_QOS_POLICY_ID   ? "deadline"
                     : policy == fast::LIVELINESS_QOS_POLICY_ID ? "liveliness"
                                                                : "another policy";
  // What is written behind the address where it is this side that asks too much, or offers too little.
  const char* way_out = "";
  if (policy == fast::RELIABILITY_QOS_POLICY_ID)
    way_out = is_writer ? "; leave out qos= behind the address" : "; write qos=best_effort behind the address";
  else if (policy == fast::DURABILITY_QOS_POLICY_ID)
    way_out = is_writer ? "; write qos=transient_local behind the address"
                        : "; leave out qos=transient_local behind the address";
  return fmt::format("somebody who {} {} {} another quality of service ({}), so that nothing passes{}",
                     is_writer ? "reads" : "publishes", shown_topic(topic), is_writer ? "wants" : "offers", what,
                     way_out);
}

// As ROS writes it: "std_msgs/msg/String" of "std_msgs::msg::dds_::String_".
std::string shown_type(std::string type) {
  for (const auto& [from, to] : {std::pair<std::string, std::string>{"::dds_::", "/"}, {"::", "/"}}) {
    for (auto at = type.find(from); at != std::string::npos; at = type.find(from)) type.replace(at, from.size(), to);
  }
  if (type.ends_with('_')) type.pop_back();
  return type;
}

class MatchedSet {
 public:
  void change(const Guid& guid, int by, bool is_ready) {
    const std::lock_guard lock(mutex_);
    if (by > 0)
      all_[guid] = {is_ready, std::chrono::steady_clock::now()};
    else
      all_.erase(guid);
  }
  [[nodiscard]] std::vector<Guid> ready() const {
    const std::lock_guard lock(mutex_);
    std::vector<Guid> out;
    for (const auto& [guid, one] : all_) {
      if (one.is_ready) out.push_back(guid);
    }
    return out;
  }
  /// True: some that were not are ready now.
  template <class F>
  bool settle(F&& is_ready_now) {
    const std::lock_guard lock(mutex_);
    bool any = false;
    for (auto& [guid, one] : all_) {
      if (!one.is_ready && is_ready_now(guid, one.since)) any = one.is_ready = true;
    }
    return any;
  }

 private:
  struct One {
    bool is_ready = false;
    std::chrono::steady_clock::time_point since;
  };
  mutable std::mutex mutex_;
  std::map<Guid, One> all_;
};

// Stands between the network and the library for the sake of Cyclone DDS. A reader of Cyclone takes for history what a
// heartbeat that is the first it sees tells of, and acknowledges it although it was never there: a request that was
// sent before it had found the writer, or that has lost a fragment by then, is not sent again, and who asked waits for
// ever. So nothing may be sent before it has seen a heartbeat. It asks for one by an empty acknowledgement of number 1,
// whose count is 0; the library hears it if the number is 0, and the count higher than before. What a heartbeat is
// answered with says that it has been seen.
class Ear final : public eprosima::fastdds::rtps::ChainingTransport {
 public:
  /// A reader of Cyclone has found that writer, and perhaps seen a heartbeat of it.
  using OnAnswer = std::function<void(const Guid& reader, const Guid& writer, bool has_seen)>;
  struct Answer {
    Guid reader{};
    Guid writer{};
    bool has_seen = false;
  };

  struct Descriptor final : eprosima::fastdds::rtps::ChainingTransportDescriptor {
    Descriptor(std::shared_ptr<TransportDescriptorInterface> below, OnAnswer hear)
        : ChainingTransportDescriptor(std::move(below)), on_answer(std::move(hear)) {}
    eprosima::fastdds::rtps::TransportInterface* create_transport() const override { return new Ear(*this); }
    OnAnswer on_answer;
  };

  explicit Ear(const Descriptor& descriptor) : ChainingTransport(descriptor), descriptor_(descriptor) {}

  eprosima::fastdds::rtps::TransportDescriptorInterface* get_configuration() override { return &descriptor_; }
  bool send(rtps::SenderResource* below, const rtps::octet* data, std::uint32_t size, rtps::LocatorsIterator* begin,
            rtps::LocatorsIterator* end, const std::chrono::steady_clock::time_point& until) override {
    return below->send(data, size, begin, end, until);
  }
  void receive(eprosima::fastdds::rtps::TransportReceiverInterface* above, const rtps::octet* data, std::uint32_t size,
               const rtps::Locator_t& here, const rtps::Locator_t& there) override {
    Octets changed;
    std::vector<Answer> answers;
    look(data, size, changed, answers);
    above->OnDataReceived(changed.empty() ? data : changed.data(), size, here, there);
    for (const auto& [reader, writer, has_seen] : answers) descriptor_.on_answer(reader, writer, has_seen);
  }

 private:
  // RTPS 2.3, 9.4: a head of 20 octets, then submessages with a head of four each.
  void look(const rtps::octet* data, std::size_t size, Octets& changed, std::vector<Answer>& answers) {
    constexpr std::size_t kHead = 20;
    constexpr std::size_t kPrefixAt = 8;
    constexpr std::size_t kPrefix = 12;
    constexpr rtps::octet kAckNack = 0x06;
    constexpr rtps::octet kInfoSource = 0x0c;
    constexpr rtps::octet kInfoDestination = 0x0e;
    constexpr rtps::octet kFinal = 2;
    // Behind reader and writer: the first number that is missing, how many bits tell of those from there on, and these.
    constexpr std::size_t kBaseAt = 8;
    constexpr std::size_t kSizeAt = 16;
    constexpr std::size_t kBitsAt = 20;
    constexpr std::uint32_t kBitsMax = 256;
    if (size < kHead || std::memcmp(data, "RTPS", 4) != 0) return;
    Guid reader{};
    std::memcpy(reader.data(), data + kPrefixAt, kPrefix);
    if (!is_cyclone(reader)) return;
    Guid writer{};
    for (std::size_t at = kHead; at + 4 <= size;) {
      const rtps::octet kind = data[at];
      const rtps::octet flags = data[at + 1];
      const bool little = (flags & 1U) != 0;
      const std::size_t length = data[at + 2] << (little ? 0U : 8U) | data[at + 3] << (little ? 8U : 0U);
      at += 4;
      if (length > size - at) return;
      if (kind == kInfoDestination && length >= kPrefix) std::memcpy(writer.data(), data + at, kPrefix);
      if (kind == kAckNack && length >= kBitsAt + 4) {
        const std::uint32_t bits = number(data + at + kSizeAt, little);
        const std::size_t count_at = kBitsAt + (bits + 31) / 32 * 4;
        if (bits > kBitsMax || length < count_at + 4) return;
        if (changed.empty()) changed.assign(data, data + size);
        const std::uint32_t count = ++count_;
        for (std::size_t i = 0; i < 4; ++i)
          changed[at + count_at + i] = static_cast<rtps::octet>(count >> (8 * (little ? i : 3 - i)));
        const bool asks = bits == 0 && (flags & kFinal) == 0;
        if (asks) std::memset(changed.data() + at + kBaseAt, 0, kSizeAt - kBaseAt);
        std::memcpy(reader.data() + kPrefix, data + at, 4);
        std::memcpy(writer.data() + kPrefix, data + at + 4, 4);
        answers.push_back({reader, writer, !asks});
      }
      // Of somebody else, or the last one.
      if (kind == kInfoSource || length == 0) return;
      at += length;
    }
  }

  static std::uint32_t number(const rtps::octet* at, bool little) {
    std::uint32_t out = 0;
    for (std::size_t i = 0; i < 4; ++i) out |= static_cast<std::uint32_t>(at[i]) << (8 * (little ? i : 3 - i));
    return out;
  }

  Descriptor descriptor_;
  std::atomic<std::uint32_t> count_{0};
};

// The library's own objects of one participant, with a topic for each name, counted.
class Core {
 public:
  fast::DomainParticipant* participant = nullptr;
  fast::Publisher* publisher = nullptr;
  fast::Subscriber* subscriber = nullptr;

  fast::Topic* topic(const Channel& channel, std::string& error) {
    const std::lock_guard lock(mutex_);
    auto& slot = topics_[channel.topic];
    if (slot.topic == nullptr) {
      fast::TypeSupport type(new OctetsType(channel.type));
      type.register_type(participant);
      slot.topic = participant->create_topic(channel.topic, channel.type, fast::TOPIC_QOS_DEFAULT);
      slot.type = channel.type;
    }
    if (slot.topic == nullptr || slot.type != channel.type) {
      error = slot.topic == nullptr
                  ? fmt::format("the topic {} cannot be made", channel.topic)
                  : fmt::format("the topic {} is used with the type {} already", channel.topic, slot.type);
      if (slot.topic == nullptr) topics_.erase(channel.topic);
      return nullptr;
    }
    ++slot.users;
    return slot.topic;
  }
  /// Tells `whom` of others at the topic that are the other way round and have another type, and of readers that are
  /// ready, until it leaves.
  void watch(const void* whom, const Channel& channel, const Guid& guid, bool is_writer, MatchedSet& matched,
             const Participant::OnChange& tell) {
    const std::lock_guard lock(watch_mutex_);
    const Watch& watch = watches_[whom] = {channel.topic, channel.type, guid, is_writer, &matched, &tell};
    for (const auto& [other, endpoint] : endpoints_) compare(watch, endpoint);
    if (settle(guid, matched)) tell("");
  }
  /// Returns when none is being told any more.
  void unwatch(const void* whom) {
    const std::lock_guard lock(watch_mutex_);
    watches_.erase(whom);
  }
  void found(const Endpoint& endpoint) {
    const std::lock_guard lock(watch_mutex_);
    if (endpoints_.size() < kEndpointsMax) endpoints_[endpoint.guid] = endpoint;
    for (const auto& [whom, watch] : watches_) compare(watch, endpoint);
  }
  void lost(const Guid& guid) {
    {
      const std::lock_guard lock(watch_mutex_);
      endpoints_.erase(guid);
    }
    const std::lock_guard lock(acknowledged_mutex_);
    acknowledged_.erase(guid);
  }
  /// A reader has found a writer, and perhaps seen a heartbeat of it; by no writer's guid, it is one that acknowledges
  /// nothing.
  void acknowledged(const Guid& reader, const Guid& writer, bool has_seen) {
    {
      const std::lock_guard lock(acknowledged_mutex_);
      if (!acknowledged_.contains(reader) && acknowledged_.size() >= kEndpointsMax) return;
      auto& writers = acknowledged_[reader];
      const auto known = writers.find(writer);
      if (known != writers.end() && (!has_seen || known->second == kSeen)) return;
      // Of most of these nothing is asked any more: their readers are ready, or they have gone.
      if (known == writers.end() && writers.size() >= kWritersMax) writers.clear();
      writers[writer] = has_seen ? kSeen : SteadyClock::now() + kAnswerMax;
      if (!has_seen) return;
    }
    const std::lock_guard lock(watch_mutex_);
    for (const auto& [whom, watch] : watches_) {
      if ((watch.guid == writer || writer == Guid{}) && settle(watch.guid, *watch.matched)) (*watch.tell)("");
    }
  }
  /// True: readers of that writer are ready that were not.
  bool settle(const Guid& writer, MatchedSet& matched) {
    const std::lock_guard lock(acknowledged_mutex_);
    const auto now = SteadyClock::now();
    return matched.settle([&](const Guid& reader, SteadyClock::time_point since) {
      if (now >= since + kSilenceMax) return true;
      const auto found = acknowledged_.find(reader);
      if (found == acknowledged_.end()) return false;
      if (found->second.contains(Guid{})) return true;
      const auto ready_at = found->second.find(writer);
      return ready_at != found->second.end() && now >= ready_at->second;
    });
  }
  /// Who only listens is nobody's server.
  void overhears(const Guid& guid, bool is_there) {
    const std::lock_guard lock(listeners_mutex_);
    if (!is_there)
      listeners_.erase(guid);
    else if (listeners_.size() < kEndpointsMax)
      listeners_.insert(guid);
  }
  [[nodiscard]] std::vector<Guid> without_listeners(std::vector<Guid> all) const {
    const std::lock_guard lock(listeners_mutex_);
    if (!listeners_.empty()) std::erase_if(all, [&](const Guid& each) { return listeners_.contains(each); });
    return all;
  }
  [[nodiscard]] std::vector<Endpoint> endpoints() const {
    const std::lock_guard lock(watch_mutex_);
    std::vector<Endpoint> out;
    for (const auto& [guid, endpoint] : endpoints_) out.push_back(endpoint);
    return out;
  }

  void leave(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto slot = topics_.find(name);
    if (slot == topics_.end() || --slot->second.users > 0) return;
    participant->delete_topic(slot->second.topic);
    topics_.erase(slot);
  }

 private:
  struct Slot {
    fast::Topic* topic = nullptr;
    std::string type;
    int users = 0;
  };
  struct Watch {
    std::string topic;
    std::string type;
    Guid guid{};
    bool is_writer = false;
    MatchedSet* matched = nullptr;
    const Participant::OnChange* tell = nullptr;
  };
  using SteadyClock = std::chrono::steady_clock;
  static constexpr SteadyClock::time_point kSeen{};
  // Who has found a writer is sent a heartbeat at once, whose answer may get lost, and is not given again.
  static constexpr std::chrono::milliseconds kAnswerMax{500};
  // Both words of a reader may get lost; it is not waited for longer than that.
  static constexpr std::chrono::seconds kSilenceMax{3};
  // Bounds of what others can make us remember.
  static constexpr std::size_t kEndpointsMax = 20'000;
  static constexpr std::size_t kWritersMax = 100;

  static void compare(const Watch& watch, const Endpoint& other) {
    if (other.topic != watch.topic || other.is_writer == watch.is_writer || other.type == watch.type) return;
    const std::string name = shown_topic(other.topic);
    (*watch.tell)(fmt::format("the types of {} differ: it is {} here, and somebody {}{}, so that nothing passes", name,
                              shown_type(watch.type), other.is_writer ? "publishes " : "reads ",
                              shown_type(other.type)));
  }

  std::mutex mutex_;
  std::map<std::string, Slot> topics_;
  mutable std::mutex watch_mutex_;
  std::map<const void*, Watch> watches_;
  std::map<Guid, Endpoint> endpoints_;
  mutable std::mutex listeners_mutex_;  // no other one is taken with it
  std::set<Guid> listeners_;
  std::mutex acknowledged_mutex_;
  std::map<Guid, std::map<Guid, SteadyClock::time_point>> acknowledged_;  // by reader and writer: when it is ready
};

template <class EndpointQos>
void set_qos(EndpointQos& qos, const Channel& channel) {
  qos.reliability().kind = channel.qos.reliable ? fast::RELIABLE_RELIABILITY_QOS : fast::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      channel.qos.transient_local ? fast::TRANSIENT_LOCAL_DURABILITY_QOS : fast::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = channel.qos.depth;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  qos.user_data().setValue({channel.user_data.begin(), channel.user_data.end()});
  qos.resource_limits().allocated_samples = 0;
}

class FastReader final : public Reader, fast::DataReaderListener {
 public:
  FastReader(std::shared_ptr<Core> core, const Channel& channel, Participant::OnSample on_sample,
             Participant::OnChange on_change)
      : core_(std::move(core)),
        name_(channel.topic),
        on_sample_(std::move(on_sample)),
        on_change_(std::move(on_change)) {}
  ~FastReader() override {
    core_->unwatch(this);
    if (reader_ != nullptr) {
      core_->overhears(guid(), false);
      reader_->set_listener(nullptr);
      core_->subscriber->delete_datareader(reader_);
    }
    core_->leave(name_);
  }
  bool open(fast::Topic* topic, const Channel& channel) {
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    set_qos(qos, channel);
    qos.type_consistency().representation.m_value = {fast::XCDR_DATA_REPRESENTATION};
    reader_ = core_->subscriber->create_datareader(topic, qos, this);
    if (reader_ == nullptr) return false;
    if (channel.user_data == kOverhears) core_->overhears(guid(), true);
    core_->watch(this, channel, guid(), false, matched_, on_change_);
    return true;
  }
  Guid guid() const override { return guid_of(reader_->guid()); }
  std::vector<Guid> matched() const override { return core_->without_listeners(matched_.ready()); }

 private:
  void on_data_available(fast::DataReader* reader) override {
    Octets octets;
    fast::SampleInfo info;
    while (reader->take_next_sample(&octets, &info) == ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      on_sample_({std::move(octets), sample_id(info.sample_identity), sample_id(info.related_sample_identity)});
      octets = {};
    }
  }
  void on_subscription_matched(fast::DataReader*, const fast::SubscriptionMatchedStatus& status) override {
    matched_.change(guid_of(status.last_publication_handle.operator const rtps::GUID_t&()), status.current_count_change,
                    true);
    on_change_("");
  }
  void on_requested_incompatible_qos(fast::DataReader*, const fast::RequestedIncompatibleQosStatus& status) override {
    on_change_(misfit_text(name_, status.last_policy_id, false));
  }

  const std::shared_ptr<Core> core_;
  const std::string name_;
  const Participant::OnSample on_sample_;
  const Participant::OnChange on_change_;
  MatchedSet matched_;
  fast::DataReader* reader_ = nullptr;
};

class FastWriter final : public Writer, fast::DataWriterListener {
 public:
  FastWriter(std::shared_ptr<Core> core, const Channel& channel, Participant::OnChange on_change)
      : core_(std::move(core)), name_(channel.topic), on_change_(std::move(on_change)) {}
  ~FastWriter() override {
    core_->unwatch(this);
    if (writer_ != nullptr) {
      core_->overhears(guid(), false);
      writer_->set_listener(nullptr);
      core_->publisher->delete_datawriter(writer_);
    }
    core_->leave(name_);
  }
  bool open(fast::Topic* topic, const Channel& channel) {
    fast::DataWriterQos qos = fast::DATAWRITER_QOS_DEFAULT;
    set_qos(qos, channel);
    qos.representation().m_value = {fast::XCDR_DATA_REPRESENTATION};
    // Calls are short and wait for each other; what is published may be large.
    if (channel.topic.starts_with("rt/")) qos.publish_mode().kind = fast::ASYNCHRONOUS_PUBLISH_MODE;
    confirms_ = channel.qos.reliable;
    qos.reliable_writer_qos().times.heartbeatPeriod = {0, kHeartbeatNs};
    writer_ = core_->publisher->create_datawriter(topic, qos, this);
    if (writer_ == nullptr) return false;
    if (channel.user_data == kOverhears) core_->overhears(guid(), true);
    core_->watch(this, channel, guid(), true, matched_, on_change_);
    return true;
  }
  Guid guid() const override { return guid_of(writer_->guid()); }
  std::vector<Guid> matched() const override {
    core_->settle(guid(), matched_);
    return core_->without_listeners(matched_.ready());
  }
  std::int64_t write(const std::vector<std::uint8_t>& octets, const SampleId* related) override {
    rtps::WriteParams params;
    if (related != nullptr) {
      params.related_sample_identity().writer_guid(guid_of(related->writer));
      params.related_sample_identity().sequence_number(rtps::SequenceNumber_t(
          static_cast<std::int32_t>(related->sequence >> 32), static_cast<std::uint32_t>(related->sequence)));
    }
    if (!writer_->write(const_cast<Octets*>(&octets), params)) return 0;
    return static_cast<std::int64_t>(params.sample_identity().sequence_number().to64long());
  }
  void flush() override { writer_->wait_for_acknowledgments({kFlushS, 0}); }

 private:
  void on_publication_matched(fast::DataWriter* writer, const fast::PublicationMatchedStatus& status) override {
    const Guid reader = guid_of(status.last_subscription_handle.operator const rtps::GUID_t&());
    matched_.change(reader, status.current_count_change, !confirms_ || !is_cyclone(reader));
    core_->settle(guid_of(writer->guid()), matched_);
    on_change_("");
  }
  void on_offered_incompatible_qos(fast::DataWriter*, const fast::OfferedIncompatibleQosStatus& status) override {
    on_change_(misfit_text(name_, status.last_policy_id, true));
  }

  const std::shared_ptr<Core> core_;
  const std::string name_;
  const Participant::OnChange on_change_;
  mutable MatchedSet matched_;
  bool confirms_ = true;  // readers acknowledge what they get
  fast::DataWriter* writer_ = nullptr;
};

// With peers of its own a participant does not look by multicast, unless that is among them.
bool look_for_peers(const ParticipantOptions& options, rtps::BuiltinAttributes& builtin, std::string& error) {
  if (!options.localhost && options.peers.empty()) return true;
  const auto look_at = [&](const std::string& address, std::uint32_t port) {
    rtps::Locator_t peer(LOCATOR_KIND_UDPv4, port);  // port 0: those of the domain
    rtps::IPLocator::setIPv4(peer, address);
    builtin.initialPeersList.push_back(peer);
  };
  if (options.localhost) {
    look_at("127.0.0.1", 0);
    // Cyclone, unless it is told otherwise, takes any free port, and tells where it is every 8 s only; it listens to
    // multicast. That of the loopback interface reaches whoever listens on this machine, on whatever interface, and
    // nobody else.
    if (options.peers.empty()) look_at("239.255.0.1", rtps::PortParameters().getMulticastPort(options.domain));
    // On all interfaces it would listen to multicast too, if it did not listen to something of its own.
    if (!options.peers.empty()) builtin.metatrafficUnicastLocatorList.push_back(rtps::Locator_t());
  } else {
    look_at("239.255.0.1", rtps::PortParameters().getMulticastPort(options.domain));
  }
  for (const std::string& host : options.peers) {
    const auto addresses = rtps::IPLocator::resolveNameDNS(host).first;
    if (addresses.empty()) {
      error = fmt::format("no machine is known by the name \"{}\"", host);
      return false;
    }
    for (const std::string& address : addresses) look_at(address, 0);
  }
  return true;
}

class FastParticipant final : public Participant, fast::DomainParticipantListener {
 public:
  ~FastParticipant() override {
    if (core_->participant == nullptr) return;
    core_->participant->set_listener(nullptr);
    core_->participant->delete_contained_entities();
    fast::DomainParticipantFactory::get_instance()->delete_participant(core_->participant);
    core_->participant = nullptr;
  }

  bool open(const ParticipantOptions& options, std::string& error) {
    // What it prints is for its own developers.
    fast::Log::SetVerbosity(fast::Log::Kind::Error);
    fast::Log::ClearConsumers();
    // Participants of one process would pass by the transport, where acknowledgements are looked for. Nobody needs two.
    eprosima::fastrtps::LibrarySettingsAttributes library;
    library.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(library);
    fast::DomainParticipantQos qos = fast::PARTICIPANT_QOS_DEFAULT;
    const std::string data = fmt::format("enclave={};", options.enclave);
    qos.name(options.enclave);
    qos.user_data().setValue({data.begin(), data.end()});
    qos.wire_protocol().builtin.readerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.wire_protocol().builtin.writerHistoryMemoryPolicy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.transport().use_builtin_transports = false;
    auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    // A burst of fragments of one large message fits.
    udp->sendBufferSize = 4U << 20U;
    udp->receiveBufferSize = 4U << 20U;
    udp->maxInitialPeersRange = kLocalPeersMax;
    if (options.localhost && options.peers.empty()) udp->interfaceWhiteList = {"127.0.0.1"};
    if (!look_for_peers(options, qos.wire_protocol().builtin, error)) return false;
    qos.transport().user_transports.push_back(std::make_shared<Ear::Descriptor>(
        udp, [weak = std::weak_ptr(core_)](const Guid& reader, const Guid& writer, bool has_seen) {
          if (const auto core = weak.lock()) core->acknowledged(reader, writer, has_seen);
        }));
    // Numbers choose ports, and others on this machine look for us only at the first ones; the library's own never come
    // back. Each is taken again as late as can be, because it is part of the identity.
    static std::atomic<std::int32_t> next{0};
    for (std::uint32_t tries = 0; tries < kLocalPeersMax && core_->participant == nullptr; ++tries) {
      qos.wire_protocol().participant_id = next++ % static_cast<std::int32_t>(kLocalPeersMax);
      core_->participant = fast::DomainParticipantFactory::get_instance()->create_participant(options.domain, qos, this,
                                                                                              fast::StatusMask::none());
    }
    if (core_->participant != nullptr) {
      core_->publisher = core_->participant->create_publisher(fast::PUBLISHER_QOS_DEFAULT);
      core_->subscriber = core_->participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
    }
    if (core_->subscriber != nullptr && core_->publisher != nullptr) return true;
    error = fmt::format("no participant can be made in domain {}; are there more than {} on this machine already?",
                        options.domain, kLocalPeersMax);
    return false;
  }

  Guid guid() const override { return guid_of(core_->participant->guid()); }

  std::unique_ptr<Reader> read(const Channel& channel, OnSample on_sample, OnChange on_change,
                               std::string& error) override {
    fast::Topic* topic = core_->topic(channel, error);
    if (topic == nullptr) return nullptr;
    auto out = std::make_unique<FastReader>(core_, channel, std::move(on_sample), std::move(on_change));
    if (out->open(topic, channel)) return out;
    error = fmt::format("no reader of {} can be made", channel.topic);
    return nullptr;
  }
  std::unique_ptr<Writer> write(const Channel& channel, OnChange on_change, std::string& error) override {
    fast::Topic* topic = core_->topic(channel, error);
    if (topic == nullptr) return nullptr;
    auto out = std::make_unique<FastWriter>(core_, channel, std::move(on_change));
    if (out->open(topic, channel)) return out;
    error = fmt::format("no writer of {} can be made", channel.topic);
    return nullptr;
  }

  std::vector<Endpoint> endpoints() const override { return core_->endpoints(); }

 private:
  template <class Info>
  void note(bool is_there, const Info& info, bool is_writer) {
    const Guid guid = guid_of(info.guid());
    const auto& data = info.m_qos.m_userData.data_vec();
    const bool overhears = std::equal(data.begin(), data.end(), kOverhears.begin(), kOverhears.end());
    if (overhears || !is_there) core_->overhears(guid, is_there);
    if (!is_there) return core_->lost(guid);
    core_->found({guid, is_writer, info.topicName().to_string(), info.typeName().to_string(), overhears,
                  info.m_qos.m_durability.kind != fast::VOLATILE_DURABILITY_QOS});
  }
  void on_subscriber_discovery(fast::DomainParticipant*, rtps::ReaderDiscoveryInfo&& info) override {
    note(info.status != rtps::ReaderDiscoveryInfo::REMOVED_READER, info.info, false);
    if (info.status != rtps::ReaderDiscoveryInfo::REMOVED_READER &&
        info.info.m_qos.m_reliability.kind == fast::BEST_EFFORT_RELIABILITY_QOS)
      core_->acknowledged(guid_of(info.info.guid()), Guid{}, true);
  }
  void on_publisher_discovery(fast::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) override {
    note(info.status != rtps::WriterDiscoveryInfo::REMOVED_WRITER, info.info, true);
  }

  std::shared_ptr<Core> core_ = std::make_shared<Core>();
};

}  // namespace
}  // namespace sentree::ros::dds

extern "C" __attribute__((visibility("default"))) sentree::ros::dds::Participant* sentree_ros_dds_4(
    const sentree::ros::dds::ParticipantOptions& options, std::string& error) {
  auto made = std::make_unique<sentree::ros::dds::FastParticipant>();
  return made->open(options, error) ? made.release() : nullptr;
}
