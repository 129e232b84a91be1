#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "sentree/bt/model.h"

// Values from text and from other types, by one set of rules for ports and entries. For the files of this library.

namespace sentree::bt {

/// What the text means for a port of that type: JSON behind "json:", a script enum where a number is wanted, else as
/// the type reads it. Nothing where it is none, or where reading it threw: `why` then has what it said. Text itself is
/// never asked for.
[[nodiscard]] std::optional<Value> value_of_text(const Model& model, const PortType& wanted, std::string_view text,
                                                 std::string* why = nullptr);

/// `wanted.accepts`; what throws accepts nothing.
[[nodiscard]] bool accepts_value(const PortType& wanted, const Value& value);

/// The object as one of the wanted type, by the casts that were registered, up or down and through several of them.
/// Null if there is no way, or the object is not of that kind.
[[nodiscard]] std::shared_ptr<const Object> cast_object(const Model& model, const std::shared_ptr<const Object>& object,
                                                        const PortType& wanted);

/// True if registered casts lead from one type to the other, whatever the object.
[[nodiscard]] bool castable(const Model& model, const PortType& from, const PortType& to);

/// True if a value of that kind is what a port of that type holds, so that no conversion is needed.
[[nodiscard]] bool fits(const PortType& wanted, const Datum& datum);

/// Text is parsed, pointers are cast, numbers are converted where nothing is lost, numbers become text.
[[nodiscard]] bool convert(const Model& model, const PortType& wanted, const Datum& from, Datum& into);

/// For messages.
[[nodiscard]] std::string shown(const Datum& datum);

}  // namespace sentree::bt
