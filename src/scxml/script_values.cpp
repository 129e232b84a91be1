#include "sentree/scxml/detail/script_values.h"

#include <cmath>
#include <cstring>

#include "sentree/scxml/detail/duktape.h"
#include "sentree/scxml/detail/script_heap.h"
#include "sentree/scxml/expression.h"
#include "sentree/text/xml.h"

namespace sentree::scxml {
namespace {

// Reads one code point; invalid bytes give U+FFFD. Surrogates pass, since scripts' strings can hold them alone.
std::uint32_t next_code_point(std::string_view text, std::size_t& at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto tail = [&](std::size_t i) { return (byte(i) & 0xC0U) == 0x80U; };
  const std::uint32_t first = byte(at);
  if (first < 0x80) return ++at, first;
  if (first >= 0xC2 && first < 0xE0 && tail(at + 1)) {
    const std::uint32_t code = (first & 0x1FU) << 6 | (byte(at + 1) & 0x3FU);
    at += 2;
    return code;
  }
  if (first >= 0xE0 && first < 0xF0 && tail(at + 1) && tail(at + 2)) {
    const std::uint32_t code = (first & 0x0FU) << 12 | (byte(at + 1) & 0x3FU) << 6 | (byte(at + 2) & 0x3FU);
    if (code >= 0x800) return at += 3, code;
  } else if (first >= 0xF0 && first < 0xF5 && tail(at + 1) && tail(at + 2) && tail(at + 3)) {
    const std::uint32_t code =
        (first & 0x07U) << 18 | (byte(at + 1) & 0x3FU) << 12 | (byte(at + 2) & 0x3FU) << 6 | (byte(at + 3) & 0x3FU);
    if (code >= 0x10000 && code <= 0x10FFFF) return at += 4, code;
  }
  ++at;
  return 0xFFFD;
}

void append_utf8(std::uint32_t code, std::string& out) {
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xC0 | code >> 6);
    out += static_cast<char>(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    out += static_cast<char>(0xE0 | code >> 12);
    out += static_cast<char>(0x80 | (code >> 6 & 0x3F));
    out += static_cast<char>(0x80 | (code & 0x3F));
  } else {
    out += static_cast<char>(0xF0 | code >> 18);
    out += static_cast<char>(0x80 | (code >> 12 & 0x3F));
    out += static_cast<char>(0x80 | (code >> 6 & 0x3F));
    out += static_cast<char>(0x80 | (code & 0x3F));
  }
}

// Items of one list that data can have.
constexpr duk_size_t kListItemsMax = 1'000'000;

// Where an `out` of a thread lives while the interpreter copies it: no destructor may wait on the stack of a long jump.
std::string& text_buffer() {
  thread_local std::string buffer;
  return buffer;
}

// An element as plain data, from which the bootstrap's DOM is made.
Value dom_tree(const text::XmlElement& element, std::string_view source) {
  Map attributes;
  element.for_each_attribute([&](std::string_view name, std::string_view value) { attributes[name] = Value(value); });
  List children;
  std::string text = element.text();
  for (text::XmlElement child = element.first_child(); child; child = child.next_sibling()) {
    children.push_back(dom_tree(child, source));
    text += children.back().find("text")->text();
  }
  return Map{{"document", false},
             {"name", element.name()},
             {"text", std::move(text)},
             {"source", source.substr(element.offset(), element.end_offset() - element.offset())},
             {"attributes", std::move(attributes)},
             {"children", std::move(children)}};
}

Value document_tree(const std::string& source) {
  const auto document = text::XmlDocument::parse(source);
  if (!document) return {};
  Value root = dom_tree(document->root(), document->source());
  Value text = *root.find("text");
  return Map{{"document", true}, {"name", "#document"}, {"text", std::move(text)},
             {"source", source}, {"attributes", Map()}, {"children", List{std::move(root)}}};
}

void push_plain_map(duk_context* ctx, const Map& map, void* make_dom) {
  const duk_idx_t object = duk_push_object(ctx);
  for (const auto& [key, item] : map) {
    push_text(ctx, key);
    push_value(ctx, item, make_dom);
    // Defined, not assigned: a key "__proto__" is a member like any other.
    duk_def_prop(ctx, object, DUK_DEFPROP_HAVE_VALUE | DUK_DEFPROP_SET_WEC);
  }
}

bool push_tagged(duk_context* ctx, const Map& map, void* make_dom) {
  const auto& [key, item] = *map.begin();
  if (key == "$undefined") {
    duk_push_undefined(ctx);
    return true;
  }
  if (key == "$date" && item.is_number()) {
    duk_get_global_string(ctx, "Date");
    duk_push_number(ctx, item.number());
    duk_new(ctx, 1);
    return true;
  }
  if (key == "$regexp" && item.as_list() && item.as_list()->size() == 2) {
    duk_get_global_string(ctx, "RegExp");
    push_text(ctx, (*item.as_list())[0].text());
    push_text(ctx, (*item.as_list())[1].text());
    duk_new(ctx, 2);
    return true;
  }
  if (key == "$xml" && item.as_string() && make_dom) {
    // The tree is kept where a long jump cannot lose it.
    thread_local Value tree;
    tree = document_tree(*item.as_string());
    if (tree.is_null()) {
      push_text(ctx, *item.as_string());
      return true;
    }
    duk_push_heapptr(ctx, make_dom);
    push_value(ctx, tree, nullptr);
    tree = Value();
    duk_call(ctx, 1);
    return true;
  }
  return false;
}

}  // namespace

void push_text(duk_context* ctx, std::string_view text) {
  bool plain = true;
  for (const char c : text) plain &= static_cast<unsigned char>(c) < 0x80;
  if (plain) {
    duk_push_lstring(ctx, text.data(), text.size());
    return;
  }
  // The interpreter keeps code points beyond U+FFFF as pairs of surrogates (CESU-8).
  std::string& buffer = text_buffer();
  buffer.clear();
  for (std::size_t at = 0; at < text.size();) {
    const std::uint32_t code = next_code_point(text, at);
    if (code < 0x10000) {
      append_utf8(code, buffer);
    } else {
      append_utf8(0xD800 + ((code - 0x10000) >> 10), buffer);
      append_utf8(0xDC00 + ((code - 0x10000) & 0x3FF), buffer);
    }
  }
  duk_push_lstring(ctx, buffer.data(), buffer.size());
}

void append_text(duk_context* ctx, int index, std::string& out) {
  duk_size_t size = 0;
  const char* data = duk_get_lstring(ctx, index, &size);
  const std::string_view text(data ? data : "", size);
  for (std::size_t at = 0; at < text.size();) {
    if (static_cast<unsigned char>(text[at]) < 0x80) {
      out += text[at++];
      continue;
    }
    std::uint32_t code = next_code_point(text, at);
    if (code >= 0xD800 && code < 0xDC00) {
      std::size_t after = at;
      const std::uint32_t low = after < text.size() ? next_code_point(text, after) : 0;
      if (low >= 0xDC00 && low < 0xE000) {
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        at = after;
      }
    }
    append_utf8(code, out);
  }
}

void push_value(duk_context* ctx, const Value& value, void* make_dom) {
  duk_require_stack(ctx, 8);
  switch (value.type()) {
    case Value::Type::kNull: duk_push_null(ctx); return;
    case Value::Type::kBool: duk_push_boolean(ctx, *value.as_bool()); return;
    case Value::Type::kInt: duk_push_number(ctx, static_cast<double>(*value.as_int())); return;
    case Value::Type::kDouble: duk_push_number(ctx, *value.as_double()); return;
    case Value::Type::kString: push_text(ctx, *value.as_string()); return;
    case Value::Type::kBytes: {
      const auto& octets = value.as_bytes()->octets;
      void* data = duk_push_fixed_buffer(ctx, octets.size());
      if (!octets.empty()) std::memcpy(data, octets.data(), octets.size());
      duk_push_buffer_object(ctx, -1, 0, octets.size(), DUK_BUFOBJ_UINT8ARRAY);
      duk_remove(ctx, -2);
      return;
    }
    case Value::Type::kList: {
      const duk_idx_t array = duk_push_array(ctx);
      duk_uarridx_t position = 0;
      for (const Value& item : *value.as_list()) {
        push_value(ctx, item, make_dom);
        duk_put_prop_index(ctx, array, position++);
      }
      return;
    }
    case Value::Type::kMap: {
      const Map& map = *value.as_map();
      if (map.size() == 1 && map.begin()->first.starts_with('$') && push_tagged(ctx, map, make_dom)) return;
      push_plain_map(ctx, map, make_dom);
      return;
    }
  }
}

namespace {

// How many enumerable members an object has itself.
duk_size_t own_members(duk_context* ctx, duk_idx_t index) {
  duk_size_t count = 0;
  duk_enum(ctx, index, DUK_ENUM_OWN_PROPERTIES_ONLY);
  while (duk_next(ctx, -1, 0) != 0) {
    duk_pop(ctx);
    ++count;
  }
  duk_pop(ctx);
  return count;
}

// Lists that are looked at by enumerating them: the interpreter knows of longer ones sooner whether they have members.
constexpr duk_size_t kShortList = 4;
constexpr int kDocumentNode = 9;  // `nodeType`

}  // namespace

void ValueReader::refuse(const char* what) {
  if (failure.empty()) failure = what;
}

void ValueReader::check_array(duk_context* ctx, int index) {
  const duk_size_t length = duk_get_length(ctx, index);
  if (length > kShortList) {
    duk_inspect_value(ctx, index);
    duk_get_prop_string(ctx, -1, "enext");
    const bool only_items = duk_is_number(ctx, -1) != 0 && duk_get_number(ctx, -1) == 0;
    duk_pop_2(ctx);
    if (only_items) return;
  }
  if (own_members(ctx, index) > length) refuse("a list with members beside its items");
}

// What is kept of a buffer are its octets, as those of an Uint8Array.
void ValueReader::check_buffer(duk_context* ctx, int index, std::size_t size) {
  if (!seen.insert(duk_get_heapptr(ctx, index)).second) refuse("one object in two places");
  duk_get_global_string(ctx, "Uint8Array");
  duk_get_prop_string(ctx, -1, "prototype");
  duk_get_prototype(ctx, index);
  const bool octets = duk_is_object(ctx, index) != 0 && duk_strict_equals(ctx, -1, -2) != 0;
  duk_pop_3(ctx);
  if (!octets) return refuse("a buffer that is no Uint8Array");
  duk_get_prop_string(ctx, index, "buffer");
  duk_get_prop_string(ctx, -1, "byteLength");
  const bool whole = duk_get_number(ctx, -1) == static_cast<double>(size);
  const bool fresh = seen.insert(duk_get_heapptr(ctx, -2)).second;
  duk_pop_2(ctx);
  if (!whole || !fresh) refuse("a part of a buffer");
}

// Objects that take no more members.
void ValueReader::check_end(duk_context* ctx, int index) {
  duk_get_global_string(ctx, "Object");
  duk_push_string(ctx, "isExtensible");
  duk_dup(ctx, index);
  duk_call_prop(ctx, -3, 1);
  if (duk_to_boolean(ctx, -1) == 0) refuse("an object that is frozen, sealed or takes no more members");
  duk_pop_2(ctx);
}

void ValueReader::check_members(duk_context* ctx, int index, bool global) {
  duk_require_stack(ctx, 12);
  index = duk_require_normalize_index(ctx, index);
  check_end(ctx, index);
  const bool array = duk_is_array(ctx, index) != 0;
  duk_enum(ctx, index, DUK_ENUM_OWN_PROPERTIES_ONLY | DUK_ENUM_INCLUDE_NONENUMERABLE | DUK_ENUM_INCLUDE_SYMBOLS);
  while (duk_next(ctx, -1, 0) != 0) {
    const bool symbol = duk_is_symbol(ctx, -1) != 0;
    const bool length = array && !symbol && std::strcmp(duk_get_string(ctx, -1), "length") == 0;
    duk_get_prop_desc(ctx, index, 0);
    bool plain = !symbol;
    for (const char* const flag : {"writable", "enumerable", "configurable"}) {
      duk_get_prop_string(ctx, -1, flag);
      const bool asked = flag[0] == 'w' || (!length && !(global && flag[0] == 'c'));
      plain = plain && (!asked || duk_to_boolean(ctx, -1) != 0);
      duk_pop(ctx);
    }
    if (!plain) refuse("a member that is hidden, read-only, an accessor or a symbol");
    duk_pop(ctx);
  }
  duk_pop(ctx);
}

bool ValueReader::read(duk_context* ctx, int index, Value& out, int depth) {
  index = duk_require_normalize_index(ctx, index);
  out = Value();
  switch (duk_get_type(ctx, index)) {
    case DUK_TYPE_NULL: return true;
    case DUK_TYPE_BOOLEAN: out = duk_get_boolean(ctx, index) != 0; return true;
    case DUK_TYPE_NUMBER: out = number_value(duk_get_number(ctx, index)); return true;
    case DUK_TYPE_STRING:
      if (duk_is_symbol(ctx, index)) {
        if (mode == Mode::kState) refuse("a symbol");
        return false;
      }
      out = std::string();
      append_text(ctx, index, const_cast<std::string&>(*out.as_string()));
      return true;
    case DUK_TYPE_OBJECT:
    case DUK_TYPE_BUFFER:
    case DUK_TYPE_LIGHTFUNC: return read_object(ctx, index, out, depth);
    default: return false;
  }
}

bool ValueReader::read_object(duk_context* ctx, int index, Value& out, int depth) {
  duk_require_stack(ctx, 12);
  if (duk_is_function(ctx, index)) {
    if (mode == Mode::kState) refuse("a function");
    return false;
  }
  if (duk_is_buffer_data(ctx, index)) {
    duk_size_t size = 0;
    const auto* data = static_cast<const std::byte*>(duk_get_buffer_data(ctx, index, &size));
    if (mode == Mode::kState) check_buffer(ctx, index, size);
    out = Bytes{data ? std::vector<std::byte>(data, data + size) : std::vector<std::byte>()};
    return true;
  }
  void* const identity = duk_get_heapptr(ctx, index);
  if (depth >= kDataNestingMax) {
    refuse("objects nested too deep");
    return true;
  }
  for (void* const outer : path) {
    if (outer != identity) continue;
    refuse("an object that contains itself");
    return true;
  }
  if (mode == Mode::kState && !seen.insert(identity).second) {
    refuse("one object in two places");
    return true;
  }
  path.push_back(identity);
  if (duk_is_array(ctx, index)) {
    out = List();
    if (mode == Mode::kState) check_array(ctx, index);
    if (mode == Mode::kState && !plain_objects) check_members(ctx, index);
    read_array(ctx, index, *out.as_list(), depth);
  } else if (!read_special(ctx, index, out, depth)) {
    out = Map();
    if (mode == Mode::kState && !plain_objects) check_members(ctx, index);
    read_members(ctx, index, *out.as_map(), depth);
  }
  path.pop_back();
  return true;
}

// Dates, regular expressions, XML. False: a plain object.
bool ValueReader::read_special(duk_context* ctx, int index, Value& out, int depth) {
  duk_get_prototype(ctx, index);
  duk_get_global_string(ctx, "Object");
  duk_get_prop_string(ctx, -1, "prototype");
  const bool bare = duk_is_undefined(ctx, -3) != 0;
  const bool plain = bare || duk_strict_equals(ctx, -3, -1);
  duk_pop_3(ctx);
  if (bare && mode == Mode::kState) refuse("an object without a prototype");
  if (plain) return false;
  // What follows is kept as what it stands for, and nothing else that it may have been given.
  if (mode == Mode::kState && !plain_objects) check_end(ctx, index);
  if (mode == Mode::kState && own_members(ctx, index) != 0)
    refuse("a date, an expression or XML with members of its own");
  duk_get_global_string(ctx, "Date");
  const bool is_date = duk_instanceof(ctx, index, -1) != 0;
  duk_get_global_string(ctx, "RegExp");
  const bool is_regexp = duk_instanceof(ctx, index, -1) != 0;
  duk_pop_2(ctx);
  if (is_date) {
    duk_push_string(ctx, mode == Mode::kState ? "getTime" : "toISOString");
    duk_call_prop(ctx, index, 0);
    if (mode == Mode::kState)
      out = Map{{"$date", number_value(duk_get_number(ctx, -1))}};
    else
      read(ctx, -1, out, depth + 1);
    duk_pop(ctx);
    return true;
  }
  if (is_regexp && mode == Mode::kState) {
    out = Map{{"$regexp", List{Value(""), Value("")}}};
    List& parts = *out.as_map()->find("$regexp")->as_list();
    duk_get_prop_string(ctx, index, "source");
    append_text(ctx, -1, const_cast<std::string&>(*parts[0].as_string()));
    duk_get_prop_string(ctx, index, "flags");
    append_text(ctx, -1, const_cast<std::string&>(*parts[1].as_string()));
    duk_get_prop_string(ctx, index, "lastIndex");
    if (!(duk_is_number(ctx, -1) && duk_get_number(ctx, -1) == 0))
      refuse("a regular expression that goes on where it has found something (lastIndex)");
    duk_pop_3(ctx);
    return true;
  }
  if (duk_has_prop_string(ctx, index, "nodeType") && duk_has_prop_string(ctx, index, "source")) {
    if (mode == Mode::kState) {
      duk_get_prop_string(ctx, index, "nodeType");
      if (duk_to_int(ctx, -1) != kDocumentNode) refuse("a part of an XML document");
      duk_pop(ctx);
    }
    duk_get_prop_string(ctx, index, "source");
    out = Map{{"$xml", Value("")}};
    append_text(ctx, -1, const_cast<std::string&>(*out.as_map()->find("$xml")->as_string()));
    duk_pop(ctx);
    return true;
  }
  if (mode == Mode::kState) refuse("an object with a prototype of its own");
  return false;
}

void ValueReader::read_array(duk_context* ctx, int index, List& list, int depth) {
  const duk_size_t length = duk_get_length(ctx, index);
  for (duk_size_t i = 0; i < length; ++i) {
    // A gap of a million items costs memory for each: the interpreter's own bound on memory does not count these.
    if (i >= kListItemsMax) {
      refuse("a list that is too long");
      return;
    }
    if (duk_get_prop_index(ctx, index, static_cast<duk_uarridx_t>(i)) == 0 && mode == Mode::kState)
      refuse("a list with gaps");
    list.emplace_back();
    if (!read(ctx, -1, list.back(), depth + 1) && (mode == Mode::kState || tags_undefined))
      list.back() = Map{{"$undefined", true}};
    duk_pop(ctx);
  }
}

void ValueReader::read_members(duk_context* ctx, int index, Map& map, int depth) {
  duk_enum(ctx, index, DUK_ENUM_OWN_PROPERTIES_ONLY);
  while (duk_next(ctx, -1, 1)) {
    std::string& key = text_buffer();
    key.clear();
    append_text(ctx, -2, key);
    Value& member = map[key];
    if (!read(ctx, -1, member, depth + 1)) {
      if (mode == Mode::kState) {
        member = Map{{"$undefined", true}};
      } else {
        text_buffer().clear();
        append_text(ctx, -2, text_buffer());
        map.erase(text_buffer());
      }
    }
    duk_pop_2(ctx);
  }
  duk_pop(ctx);
}

}  // namespace sentree::scxml
