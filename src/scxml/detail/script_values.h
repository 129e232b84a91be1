#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "sentree/base/value.h"

struct duk_hthread;

namespace sentree::scxml {

// These run inside a protected call: they may leave by a long jump, so they keep nothing on the stack that owns memory.

/// Pushes one value. Tagged maps become what they stand for: undefined, dates, regular expressions, XML.
void push_value(duk_hthread* context, const Value& value, void* make_dom);
/// Pushes text: invalid UTF-8 is replaced, so that it cannot name one of the interpreter's internal keys.
void push_text(duk_hthread* context, std::string_view text);

/// Reads values from the interpreter's stack.
struct ValueReader {
  /// kState keeps what a session needs to go on (tagged maps) and refuses what has no Value form; kMessage leaves out
  /// functions and undefined members, as JSON does.
  enum class Mode : std::uint8_t { kState, kMessage };
  Mode mode = Mode::kMessage;
  /// In a message: items of lists that are undefined (or functions) are tagged as in a state, and not null.
  bool tags_undefined = false;
  bool plain_objects = false;  ///< No script had means to make objects of another kind than literals make.
  std::string failure;         ///< Why something has no Value form; empty: all have.
  std::unordered_set<void*> seen;
  std::vector<void*> path;

  /// False: undefined (or a function, in a message); `out` is null then.
  bool read(duk_hthread* context, int index, Value& out, int depth = 0);
  /// Of a state: refuses members that are hidden, read-only or accessors, and an object that takes no more.
  /// `global`: it is the one of the session's variables, which cannot be deleted.
  void check_members(duk_hthread* context, int index, bool global = false);

 private:
  bool read_object(duk_hthread* context, int index, Value& out, int depth);
  bool read_special(duk_hthread* context, int index, Value& out, int depth);
  void read_array(duk_hthread* context, int index, List& list, int depth);
  void read_members(duk_hthread* context, int index, Map& map, int depth);
  void check_array(duk_hthread* context, int index);
  void check_buffer(duk_hthread* context, int index, std::size_t size);
  void check_end(duk_hthread* context, int index);
  void refuse(const char* what);
};

/// Appends the text at the index of the stack, which must be a string, as UTF-8.
void append_text(duk_hthread* context, int index, std::string& out);

/// JavaScript that prepares a new heap; a function expression called with (base, now, random, isIn).
extern const char* const kBootstrap;

}  // namespace sentree::scxml
