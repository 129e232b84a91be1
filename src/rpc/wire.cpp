#include "sentree/rpc/detail/wire.h"

#include <fmt/format.h>

#include <thrift/TApplicationException.h>

#include <algorithm>
#include <limits>
#include <type_traits>
#include <utility>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"

namespace sentree::rpc {
namespace {

namespace protocol = apache::thrift::protocol;
using idl::Field;
using idl::Kind;
using idl::Struct;
using idl::Type;
using protocol::TType;

// Declared sizes are believed up to here before the items have come.
constexpr std::size_t kReserveMax = 1024;
TType wire_type(const Type& type) {
  switch (type.kind) {
    case Kind::kVoid: return protocol::T_VOID;
    case Kind::kBool: return protocol::T_BOOL;
    case Kind::kI8: return protocol::T_BYTE;
    case Kind::kI16: return protocol::T_I16;
    case Kind::kI32:
    case Kind::kEnum: return protocol::T_I32;
    case Kind::kI64: return protocol::T_I64;
    case Kind::kDouble: return protocol::T_DOUBLE;
    case Kind::kString:
    case Kind::kBinary: return protocol::T_STRING;
    case Kind::kStruct: return protocol::T_STRUCT;
    case Kind::kList: return protocol::T_LIST;
    case Kind::kSet: return protocol::T_SET;
    case Kind::kMap: return protocol::T_MAP;
  }
  return protocol::T_VOID;
}

[[noreturn]] void broken(std::string why) { throw WireError{StreamStatus::kFailed, std::move(why)}; }

// Values through one of Thrift's protocols, guided by the schema. `P` is the class itself, so that its calls are not
// virtual.
template <class P>
class WireOf final : public Wire {
 public:
  WireOf(bool framed, Inbox& in, Outbox& out, const Limits& limits)
      : framed_(framed),
        in_(in),
        out_(out),
        limits_(limits),
        in_ptr_(&in, [](auto*) {}),
        out_ptr_(&out, [](auto*) {}),
        reader_(make_reader()),
        writer_(out_ptr_) {}

  void write_call(const std::string& name, MessageType type, std::int32_t sequence, const Struct& arguments,
                  const Value& values) override {
    guarded([&] {
      out_.begin_message(framed_);
      writer_.writeMessageBegin(name, static_cast<protocol::TMessageType>(type), sequence);
      writer_.writeStructBegin("");
      write_fields(arguments, values);
      writer_.writeFieldStop();
      writer_.writeStructEnd();
      writer_.writeMessageEnd();
    });
  }

  void write_reply(const std::string& name, std::int32_t sequence, const idl::Method& method,
                   const ReplyBody& body) override {
    if (body.form == ReplyBody::Form::kFailure) return write_failure(name, sequence, body.failure, body.failure_type);
    guarded([&] {
      out_.begin_message(framed_);
      writer_.writeMessageBegin(name, protocol::T_REPLY, sequence);
      writer_.writeStructBegin("");
      if (body.form == ReplyBody::Form::kException) {
        write_field(body.exception->id, *body.exception->type, body.value);
      } else if (method.result->kind != Kind::kVoid) {
        write_field(0, *method.result, body.value);
      }
      writer_.writeFieldStop();
      writer_.writeStructEnd();
      writer_.writeMessageEnd();
    });
  }

  void write_failure(const std::string& name, std::int32_t sequence, const std::string& message,
                     std::int32_t type) override {
    guarded([&] {
      out_.begin_message(framed_);
      writer_.writeMessageBegin(name, protocol::T_EXCEPTION, sequence);
      const apache::thrift::TApplicationException e(
          static_cast<apache::thrift::TApplicationException::TApplicationExceptionType>(type), message);
      e.write(&writer_);
      writer_.writeMessageEnd();
    });
  }

  MessageHead read_head() override {
    return guarded([&] {
      values_left_ = limits_.values;
      if (framed_) in_.open_frame();
      MessageHead head;
      protocol::TMessageType type = protocol::T_CALL;
      reader_->readMessageBegin(head.name, type, head.sequence);
      const int number = static_cast<int>(type);
      if (number < 1 || number > 4) broken(fmt::format("a message of the unknown type {}", number));
      head.type = static_cast<MessageType>(number);
      return head;
    });
  }

  Value read_arguments(const idl::Method& method) override {
    return guarded([&] {
      Value out = read_struct(method.arguments, 0);
      reader_->readMessageEnd();
      return out;
    });
  }

  ReplyBody read_reply(MessageType type, const idl::Method& method) override {
    return guarded([&] {
      ReplyBody out;
      if (type == MessageType::kException) {
        apache::thrift::TApplicationException e;
        e.read(reader_.get());
        reader_->readMessageEnd();
        out.form = ReplyBody::Form::kFailure;
        out.failure = e.what();
        out.failure_type = static_cast<std::int32_t>(e.getType());
        return out;
      }
      if (type != MessageType::kReply) broken("a reply was expected, a request came");
      read_result(method, out);
      reader_->readMessageEnd();
      return out;
    });
  }

  void skip_body() override {
    guarded([&] {
      reader_->skip(protocol::T_STRUCT);
      reader_->readMessageEnd();
    });
  }

  void end_message() override {
    if (!in_.frame_used_up()) broken("the frame is longer than its message");
    in_.end_message();
  }

  void reset() override { reader_ = make_reader(); }

 private:
  using BufferPtr = std::shared_ptr<apache::thrift::transport::TBufferBase>;

  std::unique_ptr<P> make_reader() const {
    const int string_max = static_cast<int>(std::min<std::size_t>(limits_.message_bytes, 0x7fffffff));
    const int items_max = static_cast<int>(std::min<std::size_t>(limits_.container_items, 0x7fffffff));
    if constexpr (std::is_same_v<P, protocol::TBinaryProtocolT<apache::thrift::transport::TBufferBase>>) {
      return std::make_unique<P>(in_ptr_, string_max, items_max, false, true);
    } else {
      return std::make_unique<P>(in_ptr_, string_max, items_max);
    }
  }

  template <class F>
  auto guarded(F&& f) -> decltype(f()) {
    try {
      return f();
    } catch (const apache::thrift::TException& e) {
      throw WireError{StreamStatus::kFailed, e.what()};
    }
  }

  // ---- writing

  void write_field(std::int16_t id, const Type& type, const Value& value) {
    writer_.writeFieldBegin("", wire_type(type), id);
    write(type, value);
    writer_.writeFieldEnd();
  }

  // The value has the order of the fields, so that one walk finds them all.
  void write_fields(const Struct& s, const Value& value) {
    const Map* map = value.as_map();
    SENTREE_ASSERT(map != nullptr);
    if (s.kind == idl::StructKind::kUnion) {
      for (const auto& [name, member] : *map) write_field(s.find(name)->id, *s.find(name)->type, member);
      return;
    }
    auto entry = map->begin();
    for (const Field& f : s.fields) {
      if (entry == map->end()) return;
      if (entry->first != f.name) continue;
      write_field(f.id, *f.type, entry->second);
      ++entry;
    }
  }

  void write(const Type& type, const Value& value) {
    switch (type.kind) {
      case Kind::kVoid: return;
      case Kind::kBool: writer_.writeBool(*value.as_bool()); return;
      case Kind::kI8: writer_.writeByte(static_cast<std::int8_t>(*value.as_int())); return;
      case Kind::kI16: writer_.writeI16(static_cast<std::int16_t>(*value.as_int())); return;
      case Kind::kI32: writer_.writeI32(static_cast<std::int32_t>(*value.as_int())); return;
      case Kind::kI64: writer_.writeI64(*value.as_int()); return;
      case Kind::kDouble: writer_.writeDouble(*value.as_double()); return;
      case Kind::kString: writer_.writeString(*value.as_string()); return;
      case Kind::kBinary: {
        const auto& octets = value.as_bytes()->octets;
        writer_.writeBinary(std::string(reinterpret_cast<const char*>(octets.data()), octets.size()));
        return;
      }
      case Kind::kEnum: {
        const auto* number = value.as_int();
        writer_.writeI32(number != nullptr ? static_cast<std::int32_t>(*number)
                                           : type.enumeration->find(value.text())->number);
        return;
      }
      case Kind::kStruct:
        writer_.writeStructBegin("");
        write_fields(*type.structure, value);
        writer_.writeFieldStop();
        writer_.writeStructEnd();
        return;
      case Kind::kList:
      case Kind::kSet: {
        const List& items = *value.as_list();
        const auto size = static_cast<std::uint32_t>(items.size());
        type.kind == Kind::kList ? writer_.writeListBegin(wire_type(*type.element), size)
                                 : writer_.writeSetBegin(wire_type(*type.element), size);
        for (const Value& item : items) write(*type.element, item);
        type.kind == Kind::kList ? writer_.writeListEnd() : writer_.writeSetEnd();
        return;
      }
      case Kind::kMap: write_map(type, value); return;
    }
  }

  void write_map(const Type& type, const Value& value) {
    const Map* named = value.as_map();
    const std::size_t size = named != nullptr ? named->size() : value.as_list()->size();
    writer_.writeMapBegin(wire_type(*type.key), wire_type(*type.element), static_cast<std::uint32_t>(size));
    if (named != nullptr) {
      for (const auto& [key, item] : *named) {
        writer_.writeString(key);
        write(*type.element, item);
      }
    } else {
      for (const Value& pair : *value.as_list()) {
        write(*type.key, (*pair.as_list())[0]);
        write(*type.element, (*pair.as_list())[1]);
      }
    }
    writer_.writeMapEnd();
  }

  // ---- reading

  // The next field, or false at the end of the struct.
  bool next_field(TType& type, std::int16_t& id) {
    reader_->readFieldBegin(ignored_, type, id);
    return type != protocol::T_STOP;
  }

  void skip(TType type) {
    reader_->skip(type);
    reader_->readFieldEnd();
  }

  void read_result(const idl::Method& method, ReplyBody& out) {
    TType type = protocol::T_STOP;
    std::int16_t id = 0;
    bool found = method.result->kind == Kind::kVoid;
    reader_->readStructBegin(ignored_);
    while (next_field(type, id)) {
      const auto exception =
          std::find_if(method.exceptions.begin(), method.exceptions.end(), [&](const Field& f) { return f.id == id; });
      if (id == 0 && method.result->kind != Kind::kVoid && type == wire_type(*method.result)) {
        out.value = read(*method.result, 1);
        found = true;
        reader_->readFieldEnd();
      } else if (exception != method.exceptions.end() && type == protocol::T_STRUCT) {
        out.form = ReplyBody::Form::kException;
        out.exception = &*exception;
        out.value = read(*exception->type, 1);
        found = true;
        reader_->readFieldEnd();
      } else {
        skip(type);
      }
    }
    reader_->readStructEnd();
    if (!found) broken(fmt::format("the reply to {} holds no result", method.name));
  }

  void count_value(int depth) {
    if (depth > limits_.nesting) broken(fmt::format("values are nested more than {} deep", limits_.nesting));
    if (values_left_ == 0) broken(fmt::format("the message holds more than {} values", limits_.values));
    --values_left_;
  }

  Value read_struct(const Struct& s, int depth) {
    Map out;
    out.reserve(std::min(s.fields.size(), kReserveMax));
    TType type = protocol::T_STOP;
    std::int16_t id = 0;
    std::size_t next = 0;  // the first field not decided yet
    reader_->readStructBegin(ignored_);
    while (next_field(type, id)) {
      // Writers keep the order of the fields, so the field is nearly always the next one.
      std::size_t i = next;
      if (i >= s.fields.size() || s.fields[i].id != id) {
        const auto found = std::find_if(s.fields.begin(), s.fields.end(), [&](const Field& f) { return f.id == id; });
        i = static_cast<std::size_t>(found - s.fields.begin());
      }
      if (i == s.fields.size() || wire_type(*s.fields[i].type) != type) {
        skip(type);
        continue;
      }
      Value value = read(*s.fields[i].type, depth + 1);
      reader_->readFieldEnd();
      if (s.kind == idl::StructKind::kUnion) {
        out = Map();
        out.append(s.fields[i].name, std::move(value));
      } else if (i >= next) {
        fill_in(s, next, i, out);
        out.append(s.fields[i].name, std::move(value));
        next = i + 1;
      } else {
        put_back(s, i, std::move(value), out);
      }
    }
    reader_->readStructEnd();
    if (s.kind != idl::StructKind::kUnion) {
      fill_in(s, next, s.fields.size(), out);
      for (const Field& f : s.fields) {
        if (f.requiredness != idl::Requiredness::kRequired) continue;
        const Value* there = out.find(f.name);
        if (there == nullptr || there->is_null())
          broken(fmt::format("the required field \"{}\" of {} is missing", f.name, s.name));
      }
    }
    return Value(std::move(out));
  }

  void fill_in(const Struct& s, std::size_t from, std::size_t to, Map& out) {
    for (std::size_t i = from; i < to; ++i) {
      const Field& f = s.fields[i];
      // A required field has no stand-in; it is looked for at the end, for it may still come out of order.
      if (f.requiredness == idl::Requiredness::kRequired || !f.when_absent) continue;
      count_value(0);
      out.append(f.name, *f.when_absent);
    }
  }

  // A field that comes after a later one: replaces its stand-in, or goes to its place.
  void put_back(const Struct& s, std::size_t i, Value value, Map& out) {
    if (Value* there = out.find(s.fields[i].name)) {
      *there = std::move(value);
      return;
    }
    Map ordered;
    const auto keep = [&](std::size_t from, std::size_t to) {
      for (std::size_t k = from; k < to; ++k) {
        if (Value* there = out.find(s.fields[k].name)) ordered.append(s.fields[k].name, std::move(*there));
      }
    };
    keep(0, i);
    ordered.append(s.fields[i].name, std::move(value));
    keep(i + 1, s.fields.size());
    out = std::move(ordered);
  }

  Value read(const Type& type, int depth) {
    count_value(depth);
    switch (type.kind) {
      case Kind::kVoid: return {};
      case Kind::kBool: {
        bool b = false;
        reader_->readBool(b);
        return Value(b);
      }
      case Kind::kI8: {
        std::int8_t n = 0;
        reader_->readByte(n);
        return Value(std::int64_t{n});
      }
      case Kind::kI16: {
        std::int16_t n = 0;
        reader_->readI16(n);
        return Value(std::int64_t{n});
      }
      case Kind::kI32: {
        std::int32_t n = 0;
        reader_->readI32(n);
        return Value(std::int64_t{n});
      }
      case Kind::kI64: {
        std::int64_t n = 0;
        reader_->readI64(n);
        return Value(n);
      }
      case Kind::kDouble: {
        double d = 0;
        reader_->readDouble(d);
        return Value(d);
      }
      case Kind::kString: {
        std::string text;
        reader_->readString(text);
        return Value(std::move(text));
      }
      case Kind::kBinary: {
        std::string text;
        reader_->readBinary(text);
        const auto* octets = reinterpret_cast<const std::byte*>(text.data());
        return Value(Bytes{{octets, octets + text.size()}});
      }
      case Kind::kEnum: {
        std::int32_t n = 0;
        reader_->readI32(n);
        const idl::Enumerator* e = type.enumeration->find(std::int64_t{n});
        return e != nullptr ? Value(e->name) : Value(std::int64_t{n});
      }
      case Kind::kStruct: return read_struct(*type.structure, depth);
      case Kind::kList:
      case Kind::kSet: return read_items(type, depth);
      case Kind::kMap: return read_map(type, depth);
    }
    return {};
  }

  Value read_items(const Type& type, int depth) {
    TType element = protocol::T_VOID;
    std::uint32_t size = 0;
    type.kind == Kind::kList ? reader_->readListBegin(element, size) : reader_->readSetBegin(element, size);
    if (size > 0 && element != wire_type(*type.element))
      broken(fmt::format("the items of a {} have another type", type.name));
    List items;
    items.reserve(std::min<std::size_t>(size, kReserveMax));
    for (std::uint32_t i = 0; i < size; ++i) items.push_back(read(*type.element, depth + 1));
    type.kind == Kind::kList ? reader_->readListEnd() : reader_->readSetEnd();
    if (type.kind == Kind::kSet) idl::drop_duplicates(items);
    return Value(std::move(items));
  }

  Value read_map(const Type& type, int depth) {
    TType key = protocol::T_VOID;
    TType element = protocol::T_VOID;
    std::uint32_t size = 0;
    reader_->readMapBegin(key, element, size);
    if (size > 0 && (key != wire_type(*type.key) || element != wire_type(*type.element))) {
      broken(fmt::format("the entries of a {} have other types", type.name));
    }
    List pairs;
    pairs.reserve(std::min<std::size_t>(size, kReserveMax));
    for (std::uint32_t i = 0; i < size; ++i) {
      Value k = read(*type.key, depth + 1);
      Value v = read(*type.element, depth + 1);
      List pair;
      pair.reserve(2);
      pair.push_back(std::move(k));
      pair.push_back(std::move(v));
      pairs.emplace_back(std::move(pair));
    }
    reader_->readMapEnd();
    idl::drop_duplicate_keys(pairs);
    if (type.key->kind != Kind::kString) return Value(std::move(pairs));
    Map named;
    named.reserve(pairs.size());
    for (Value& pair : pairs) {
      List& both = *pair.as_list();
      named.append(std::string(both[0].text()), std::move(both[1]));
    }
    return Value(std::move(named));
  }

  bool framed_;
  Inbox& in_;
  Outbox& out_;
  Limits limits_;
  BufferPtr in_ptr_;  // Thrift wants shared pointers; ours do not own.
  BufferPtr out_ptr_;
  std::unique_ptr<P> reader_;
  P writer_;
  std::size_t values_left_ = 0;
  std::string ignored_;
};

}  // namespace

std::unique_ptr<Wire> Wire::make(Address::Protocol encoding, bool framed, Inbox& in, Outbox& out,
                                 const Limits& limits) {
  using Buffer = apache::thrift::transport::TBufferBase;
  if (encoding == Address::Protocol::kCompact) {
    return std::make_unique<WireOf<protocol::TCompactProtocolT<Buffer>>>(framed, in, out, limits);
  }
  return std::make_unique<WireOf<protocol::TBinaryProtocolT<Buffer>>>(framed, in, out, limits);
}

Encoding detect_encoding(Inbox& in) {
  // Binary begins with 0x80 0x01, compact with 0x82. A frame's length begins with 0 under any bound below 16 MB, and
  // what is inside says the rest. A binary message without version begins with its name's length, and then the name.
  const auto of = [](std::uint8_t first) {
    return first == 0x82 ? Address::Protocol::kCompact : Address::Protocol::kBinary;
  };
  const std::uint8_t first = in.peek(1)[0];
  if (first == 0x80 || first == 0x82) return {of(first), false};
  const std::uint8_t fifth = in.peek(5)[4];
  const bool framed = fifth == 0x80 || fifth == 0x82 || fifth == 0;
  if (first > 0x01) throw WireError{StreamStatus::kFailed, "this is no Thrift message"};
  return {of(fifth), framed};
}

}  // namespace sentree::rpc
