#include "sentree/ros/detail/mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace sentree::ros {
namespace {

constexpr const char* kFailure = "error";
constexpr const char* kResult = "result";

const idl::Type& text_type() {
  static const idl::Type kText{idl::Kind::kString, "string", nullptr, nullptr, nullptr, nullptr};
  return kText;
}

std::string capital(std::string name) {
  if (!name.empty() && name.front() >= 'a' && name.front() <= 'z') name.front() = static_cast<char>(name.front() - 32);
  return name;
}

// What stands for the package of a Thrift file: its name.
std::string package_of(std::string file) {
  file = file.substr(file.find_last_of('/') + 1);
  return file.substr(0, file.find('.'));
}

}  // namespace

std::optional<TypeName> type_name(std::string_view text) {
  const auto first = text.find('/');
  const auto last = text.rfind('/');
  if (first == std::string_view::npos || first == last) return std::nullopt;
  TypeName out{std::string(text.substr(0, first)), std::string(text.substr(first + 1, last - first - 1)),
               std::string(text.substr(last + 1))};
  if (out.form != "msg" && out.form != "srv" && out.form != "action") return std::nullopt;
  return out;
}

std::string dds_name(const TypeName& type, std::string_view suffix) {
  return fmt::format("{}::{}::dds_::{}{}_", type.package, type.form, type.name, suffix);
}

std::string ros_name(std::string_view dds_type) {
  std::string out;
  while (!dds_type.empty()) {
    const auto end = std::min(dds_type.find("::"), dds_type.size());
    const std::string_view part = dds_type.substr(0, end);
    dds_type.remove_prefix(std::min(end + 2, dds_type.size()));
    if (part != "dds_") out += (out.empty() ? "" : "/") + std::string(part);
  }
  if (out.ends_with('_')) out.pop_back();
  return type_name(out) ? out : "";
}

Form form_of(const idl::Service& interface) {
  const auto name = type_name(interface.name);
  if (!name) return Form::kThrift;
  return name->form == "msg" ? Form::kMessage : name->form == "srv" ? Form::kService : Form::kAction;
}

bool is_data(const idl::Service& interface) {
  return !interface.methods.empty() &&
         std::all_of(interface.methods.begin(), interface.methods.end(), [](const auto* m) { return m->oneway; });
}

Result<std::shared_ptr<const Carried>> Carried::make(const idl::Service& interface, const idl::Method& method,
                                                     const std::string& base) {
  auto out = std::make_shared<Carried>();
  out->method = &method;
  out->name = base;
  TypeName type = type_name(interface.name).value_or(TypeName{});
  const idl::Struct* reply = method.result != nullptr ? method.result->structure : nullptr;
  if (form_of(interface) == Form::kThrift) {
    out->is_thrift_ = true;
    out->name += (base.ends_with('/') ? "" : "/") + method.name;
    // By the service that declares it, so that an heir is called as its base.
    const std::string declared = method.service.substr(method.service.rfind('.') + 1);
    type = {package_of(method.span.file), method.oneway ? "msg" : "srv", declared + capital(method.name)};
    const auto add = [&](std::string name, const idl::Type* of, idl::Requiredness requiredness) {
      idl::Field& f = out->response_.fields.emplace_back();
      f.name = std::move(name);
      f.type = of;
      f.requiredness = requiredness;
    };
    out->response_.name = type.name + "_Response";
    add(kFailure, &text_type(), idl::Requiredness::kDefault);
    if (method.result != nullptr && method.result->kind != idl::Kind::kVoid)
      add(kResult, method.result, idl::Requiredness::kOptional);
    for (const idl::Field& f : method.exceptions) add(f.name, f.type, idl::Requiredness::kOptional);
    reply = &out->response_;
  }
  out->type = dds_name(type);
  out->request_type = dds_name(type, "_Request");
  out->reply_type = dds_name(type, "_Response");
  auto arguments = Codec::make(method.arguments);
  if (!arguments)
    return fail("ros.type", fmt::format("{}.{}: {}", interface.name, method.name, arguments.error().message));
  out->arguments_ = std::move(*arguments);
  if (!method.oneway && reply != nullptr) {
    auto codec = Codec::make(*reply);
    if (!codec) return fail("ros.type", fmt::format("{}.{}: {}", interface.name, method.name, codec.error().message));
    out->reply_ = std::move(*codec);
  }
  return std::shared_ptr<const Carried>(std::move(out));
}

Result<bool> Carried::write_outcome(std::vector<std::uint8_t>& out, const rpc::Outcome& outcome) const {
  if (!is_thrift_) {
    if (!outcome) return false;
    auto written = reply_->write(out, *outcome);
    if (!written) return tl::unexpected(std::move(written.error()));
    return true;
  }
  Map reply{{kFailure, ""}};
  if (outcome) {
    if (!outcome->is_null()) reply[kResult] = *outcome;
  } else {
    const rpc::CallError& error = outcome.error();
    reply[kFailure] = error.message.empty() ? std::string(to_string(error.kind)) : error.message;
    for (const idl::Field& f : method->exceptions) {
      if (error.kind == rpc::CallErrorKind::kException && f.type->structure->name == error.exception)
        reply[f.name] = error.data;
    }
  }
  auto written = reply_->write(out, Value(std::move(reply)));
  if (!written) return tl::unexpected(std::move(written.error()));
  return true;
}

rpc::Outcome Carried::read_outcome(std::span<const std::uint8_t> message, const rpc::Limits& limits) const {
  const auto broken = [&](const std::string& why) {
    return tl::unexpected(rpc::CallError{
        rpc::CallErrorKind::kProtocol, fmt::format("the reply of {} cannot be read: {}", name, why), {}, {}});
  };
  auto reply = reply_->read(message, kEncapsulation, limits);
  if (!reply) return broken(reply.error().message);
  if (!is_thrift_) return std::move(*reply);
  const std::string failure(reply->find(kFailure)->text());
  for (const idl::Field& f : method->exceptions) {
    if (const Value* data = reply->find(f.name))
      return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kException, failure, f.type->structure->name, *data});
  }
  if (!failure.empty()) return tl::unexpected(rpc::CallError{rpc::CallErrorKind::kProtocol, failure, {}, {}});
  if (method->result == nullptr || method->result->kind == idl::Kind::kVoid) return Value();
  if (const Value* result = reply->find(kResult)) return *result;
  return broken("there is neither a result nor an error");
}

}  // namespace sentree::ros
