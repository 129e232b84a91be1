#include "sentree/idl/detail/syntax.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include "sentree/idl/detail/lexer.h"

namespace sentree::idl::syntax {
namespace {

using Form = Token::Form;

constexpr auto kKeywords = std::to_array<std::string_view>(
    {"async",   "binary",    "bool",    "byte",      "const",        "cpp_include", "cpp_type", "double",
     "enum",    "exception", "extends", "false",     "i16",          "i32",         "i64",      "i8",
     "include", "list",      "map",     "namespace", "oneway",       "optional",    "required", "senum",
     "service", "set",       "slist",   "string",    "struct",       "throws",      "true",     "typedef",
     "union",   "void",      "xsd_all", "xsd_attrs", "xsd_nillable", "xsd_optional"});

// Words of some target language; the compiler refuses them whatever the language asked for.
constexpr auto kReserved = std::to_array<std::string_view>(
    {"BEGIN",         "END",       "__CLASS__",  "__DIR__", "__FILE__",     "__FUNCTION__", "__LINE__",  "__METHOD__",
     "__NAMESPACE__", "abstract",  "alias",      "and",     "args",         "as",           "assert",    "begin",
     "break",         "case",      "catch",      "class",   "clone",        "continue",     "declare",   "def",
     "default",       "del",       "delete",     "do",      "dynamic",      "elif",         "else",      "elseif",
     "elsif",         "end",       "enddeclare", "endfor",  "endforeach",   "endif",        "endswitch", "endwhile",
     "ensure",        "except",    "exec",       "finally", "float",        "for",          "foreach",   "from",
     "function",      "global",    "goto",       "if",      "implements",   "import",       "in",        "inline",
     "instanceof",    "interface", "is",         "lambda",  "module",       "native",       "new",       "next",
     "nil",           "not",       "or",         "package", "pass",         "public",       "print",     "private",
     "protected",     "raise",     "redo",       "rescue",  "retry",        "register",     "return",    "self",
     "sizeof",        "static",    "super",      "switch",  "synchronized", "then",         "this",      "throw",
     "transient",     "try",       "undef",      "unless",  "unsigned",     "until",        "use",       "var",
     "virtual",       "volatile",  "when",       "while",   "with",         "xor",          "yield"});

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string shown_token(const Token& token) {
  switch (token.form) {
    case Form::kEnd: return "the end of the file";
    case Form::kSymbol: return fmt::format("\"{}\"", token.symbol);
    case Form::kWord: return fmt::format("\"{}\"", token.word);
    case Form::kText: return "a string";
    case Form::kInt:
    case Form::kDouble: return "a number";
  }
  return {};
}

// Recursive descent with one token of look-ahead. The first error ends the parse: every rule returns false from there
// on.
class Parser {
 public:
  Parser(std::string_view source, const std::string& file, File& out, Diagnostics& diagnostics)
      : lexer_(source), lines_(source), file_(file), out_(out), diagnostics_(diagnostics) {}

  bool parse() {
    if (!advance()) return false;
    while (is_word("include") || is_word("namespace") || is_word("cpp_include")) {
      if (!header()) return false;
    }
    while (token_.form != Form::kEnd) {
      if (!definition()) return false;
    }
    return true;
  }

 private:
  SourceSpan span(std::size_t offset, std::size_t length) const {
    const auto at = lines_.position(offset);
    return {file_, at.line, at.column, static_cast<int>(length)};
  }
  SourceSpan here() const { return span(token_.offset, token_.length); }

  bool error(const SourceSpan& at, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kError, std::move(code), std::move(message), at});
    return false;
  }
  bool expected(std::string_view what) {
    return error(here(), "idl.syntax", fmt::format("expected {}, found {}", what, shown_token(token_)));
  }
  void warn(const SourceSpan& at, std::string code, std::string message) {
    diagnostics_.push_back({Severity::kWarning, std::move(code), std::move(message), at});
  }

  bool advance() {
    if (lexer_.next(token_)) return true;
    return error(span(lexer_.error_offset(), 1), "idl.syntax", lexer_.error());
  }
  bool is_word(std::string_view word) const { return token_.form == Form::kWord && token_.word == word; }
  bool is_symbol(char symbol) const { return token_.form == Form::kSymbol && token_.symbol == symbol; }
  bool symbol(char symbol) {
    if (!is_symbol(symbol)) return expected(fmt::format("\"{}\"", symbol));
    return advance();
  }
  bool skip_separator() { return is_symbol(',') || is_symbol(';') ? advance() : true; }

  bool identifier(std::string_view what, std::string& name) {
    if (token_.form == Form::kWord && contains(kKeywords, token_.word)) {
      return error(here(), "idl.syntax",
                   fmt::format("\"{}\" is a word of the IDL; {} needs another name", token_.word, what));
    }
    if (token_.form != Form::kWord) return expected(what);
    name = token_.word;
    return advance();
  }
  // A name that the file declares: without dots, and no word of a target language.
  bool declared(std::string_view what, std::string& name, SourceSpan& at, bool dots = false) {
    at = here();
    if (!identifier(what, name)) return false;
    if (!dots && name.find('.') != std::string::npos) {
      return error(at, "idl.syntax", fmt::format("the name \"{}\" must not have a dot", name));
    }
    if (contains(kReserved, name)) {
      return error(
          at, "idl.syntax",
          fmt::format("\"{}\" is a reserved word of a language that Thrift generates; choose another name", name));
    }
    return true;
  }
  bool text(std::string_view what, std::string& out) {
    if (token_.form != Form::kText) return expected(what);
    out = token_.text;
    return advance();
  }

  bool header() {
    if (is_word("namespace")) {
      if (!advance()) return false;
      // Of generated code, which there is none of.
      std::string ignored;
      const bool any = is_symbol('*');
      if (any ? !advance() : !identifier("a language or *", ignored)) return false;
      if (!identifier("the namespace", ignored)) return false;
      return any || annotations();
    }
    const bool cpp = is_word("cpp_include");
    if (!advance()) return false;
    const SourceSpan at = here();
    std::string path;
    if (!text("the file's name in quotes", path)) return false;
    if (!cpp) out_.includes.push_back({std::move(path), at});
    return true;
  }

  // Of all annotations four mean something here: the unit of what is annotated, the bounds of a number, and whether a
  // method may be asked again.
  bool annotations(std::string* unit = nullptr, Field* bounded = nullptr, bool* idempotent = nullptr) {
    if (!is_symbol('(')) return true;
    if (!advance()) return false;
    while (!is_symbol(')')) {
      static const std::vector<std::string> kKnown{"unit", "min", "max", "idempotent"};
      std::string name;
      std::string value;
      const SourceSpan at = here();
      if (!identifier("an annotation or \")\"", name)) return false;
      if (std::find(kKnown.begin(), kKnown.end(), name) == kKnown.end()) {
        if (const std::string near = did_you_mean(name, kKnown); !near.empty())
          warn(at, "idl.annotation", fmt::format("annotation \"{}\" means nothing here{}", name, near));
      }
      if (is_symbol('=') && (!advance() || !text("the annotation's value in quotes", value))) return false;
      if (unit != nullptr && name == "unit") *unit = value;
      if (idempotent != nullptr && name == "idempotent") {
        if (value != "true" && value != "false")
          return error(here(), "idl.syntax", fmt::format("idempotent = \"{}\" must be \"true\" or \"false\"", value));
        *idempotent = value == "true";
      }
      if (bounded != nullptr && (name == "min" || name == "max")) {
        double bound = 0;
        const auto [end, failure] = std::from_chars(value.data(), value.data() + value.size(), bound);
        if (failure != std::errc() || end != value.data() + value.size())
          return error(here(), "idl.syntax", fmt::format("{} = \"{}\" must be a number", name, value));
        (name == "min" ? bounded->min : bounded->max) = bound;
      }
      if (!skip_separator()) return false;
    }
    return advance();
  }

  bool definition() {
    Definition d;
    bool good = false;
    if (is_word("const")) {
      d.form = Definition::Form::kConst;
      good = advance() && type(d.type, 0) && declared("the constant's name", d.name, d.span) && symbol('=') &&
             constant(d.value, 0) && skip_separator();
    } else if (is_word("typedef")) {
      d.form = Definition::Form::kTypedef;
      good = advance() && type(d.type, 0) && declared("the new type's name", d.name, d.span) && annotations() &&
             skip_separator();
    } else if (is_word("enum")) {
      d.form = Definition::Form::kEnum;
      good = advance() && declared("the enum's name", d.name, d.span) && enumerators(d) && annotations();
    } else if (is_word("struct") || is_word("union")) {
      d.form = Definition::Form::kStruct;
      d.struct_kind = is_word("union") ? StructKind::kUnion : StructKind::kStruct;
      good = advance() && declared("the struct's name", d.name, d.span);
      if (good && is_word("xsd_all")) good = advance();
      good = good && symbol('{') && fields('}', d.fields, 0) && annotations();
    } else if (is_word("exception")) {
      d.form = Definition::Form::kStruct;
      d.struct_kind = StructKind::kException;
      good = advance() && declared("the exception's name", d.name, d.span) && symbol('{') && fields('}', d.fields, 0) &&
             annotations();
    } else if (is_word("service")) {
      d.form = Definition::Form::kService;
      good = advance() && declared("the service's name", d.name, d.span) && service(d) && annotations();
    } else if (is_word("senum") || is_word("slist")) {
      return error(here(), "idl.syntax", fmt::format("\"{}\" is no longer supported; use string", token_.word));
    } else if (is_word("include") || is_word("namespace") || is_word("cpp_include")) {
      return error(here(), "idl.syntax", fmt::format("\"{}\" must stand before the first definition", token_.word));
    } else {
      return expected("const, typedef, enum, struct, union, exception or service");
    }
    if (good) out_.definitions.push_back(std::move(d));
    return good;
  }

  bool enumerators(Definition& d) {
    if (!symbol('{')) return false;
    std::int64_t next = 0;
    while (!is_symbol('}')) {
      Enumerator e;
      // The compiler lets a name with a dot pass where a number follows it.
      if (!declared("an enumerator or \"}\"", e.name, e.span, true)) return false;
      if (is_symbol('=')) {
        if (!advance()) return false;
        if (!integer("the enumerator's number", next)) return false;
      } else if (e.name.find('.') != std::string::npos) {
        return error(e.span, "idl.syntax", fmt::format("the name \"{}\" must not have a dot", e.name));
      }
      if (next < std::numeric_limits<std::int32_t>::min() || next > std::numeric_limits<std::int32_t>::max()) {
        return error(e.span, "idl.number-range",
                     fmt::format("enumerator \"{}\" has the number {}, which does not fit into an i32", e.name, next));
      }
      e.number = static_cast<std::int32_t>(next++);
      d.enumerators.push_back(std::move(e));
      if (!annotations() || !skip_separator()) return false;
    }
    return advance();
  }

  bool integer(std::string_view what, std::int64_t& out) {
    if (is_word("true") || is_word("false")) {
      out = is_word("true") ? 1 : 0;
      return advance();
    }
    if (token_.form != Form::kInt) return expected(what);
    out = token_.integer;
    return advance();
  }

  bool fields(char end, std::vector<Field>& out, int depth) {
    if (depth > kSyntaxNestingMax) return error(here(), "idl.too-deep", "fields are nested too deeply");
    std::int32_t automatic = -1;
    std::unordered_set<std::string> names;
    std::unordered_map<std::int32_t, std::string> ids;
    while (!is_symbol(end)) {
      Field f;
      const SourceSpan id_span = here();
      bool numbered = false;
      if (token_.form == Form::kInt || is_word("true") || is_word("false")) {
        std::int64_t id = 0;
        if (!integer("a field number", id) || !symbol(':')) return false;
        numbered = id > 0;
        if (!numbered) {
          warn(id_span, "idl.field-id", "field numbers begin at 1; this one is ignored");
        } else if (id > std::numeric_limits<std::int16_t>::max()) {
          warn(id_span, "idl.field-id",
               fmt::format("field number {} does not fit into an i16 and will be truncated", id));
        }
        if (numbered) f.id = static_cast<std::int32_t>(id);
      }
      if (!numbered) f.id = automatic--;
      if (is_word("required") || is_word("optional")) {
        f.requiredness = is_word("required") ? Requiredness::kRequired : Requiredness::kOptional;
        if (!advance()) return false;
      }
      if (!type(f.type, 0)) return false;
      if (is_symbol('&') && !advance()) return false;
      if (!declared("the field's name", f.name, f.span)) return false;
      if (!numbered) {
        warn(f.span, "idl.field-id",
             fmt::format("field \"{}\" has no number; write one, so that it stays the same in the next version",
                         f.name));
      }
      if (is_symbol('=')) {
        f.value.emplace_back();
        if (!advance() || !constant(f.value.back(), 0)) return false;
      }
      if (is_word("xsd_optional") && !advance()) return false;
      if (is_word("xsd_nillable") && !advance()) return false;
      if (is_word("xsd_attrs")) {
        std::vector<Field> ignored;
        if (!advance() || !symbol('{') || !fields('}', ignored, depth + 1)) return false;
      }
      if (!annotations(&f.unit, &f) || !skip_separator()) return false;
      if (!names.insert(f.name).second) {
        return error(f.span, "idl.duplicate", fmt::format("there is a field \"{}\" already", f.name));
      }
      if (const auto [other, fresh] = ids.emplace(f.id, f.name); !fresh) {
        return error(f.span, "idl.duplicate",
                     fmt::format("field number {} of \"{}\" is that of \"{}\" already", f.id, f.name, other->second));
      }
      out.push_back(std::move(f));
    }
    return advance();
  }

  bool service(Definition& d) {
    if (is_word("extends")) {
      if (!advance()) return false;
      d.base_span = here();
      if (!identifier("the base service", d.base)) return false;
    }
    if (!symbol('{')) return false;
    while (!is_symbol('}')) {
      Method m;
      if (is_word("oneway") || is_word("async")) {
        if (is_word("async")) warn(here(), "idl.deprecated", "\"async\" is called \"oneway\" now");
        m.oneway = true;
        if (!advance()) return false;
      }
      if (is_word("void")) {
        m.result.span = here();
        if (!advance()) return false;
      } else if (!type(m.result, 0)) {
        return false;
      }
      if (!declared("the method's name", m.name, m.span)) return false;
      if (!symbol('(') || !fields(')', m.arguments, 0)) return false;
      if (is_word("throws") && (!advance() || !symbol('(') || !fields(')', m.exceptions, 0))) return false;
      if (!annotations(&m.unit, nullptr, &m.idempotent) || !skip_separator()) return false;
      d.methods.push_back(std::move(m));
    }
    return advance();
  }

  static std::optional<Kind> base_kind(std::string_view word) {
    constexpr std::pair<std::string_view, Kind> kKinds[] = {
        {"bool", Kind::kBool},     {"byte", Kind::kI8},       {"i8", Kind::kI8},
        {"i16", Kind::kI16},       {"i32", Kind::kI32},       {"i64", Kind::kI64},
        {"double", Kind::kDouble}, {"string", Kind::kString}, {"binary", Kind::kBinary}};
    for (const auto& [name, kind] : kKinds) {
      if (name == word) return kind;
    }
    return std::nullopt;
  }

  bool cpp_type() {
    if (!is_word("cpp_type")) return true;
    std::string ignored;
    return advance() && text("the C++ type in quotes", ignored);
  }

  bool type(TypeUse& out, int depth) {
    out.span = here();
    if (depth > kSyntaxNestingMax) return error(out.span, "idl.too-deep", "types are nested too deeply");
    if (token_.form != Form::kWord) return expected("a type");
    if (const auto kind = base_kind(token_.word)) {
      out.form = TypeUse::Form::kBase;
      out.base = *kind;
      return advance() && annotations();
    }
    const bool map = is_word("map");
    if (map || is_word("list") || is_word("set")) {
      out.form = map ? TypeUse::Form::kMap : is_word("list") ? TypeUse::Form::kList : TypeUse::Form::kSet;
      // Of a list the compiler reads it behind, of the others before the brackets.
      const bool list = out.form == TypeUse::Form::kList;
      if (!advance() || (!list && !cpp_type()) || !symbol('<')) return false;
      out.arguments.resize(map ? 2 : 1);
      if (!type(out.arguments[0], depth + 1)) return false;
      if (map && (!symbol(',') || !type(out.arguments[1], depth + 1))) return false;
      if (!symbol('>')) return false;
      if (list && !cpp_type()) return false;
      return annotations();
    }
    if (is_word("void")) return error(out.span, "idl.syntax", "only a method's result can be void");
    if (is_word("slist")) return error(out.span, "idl.syntax", "\"slist\" is no longer supported; use string");
    out.form = TypeUse::Form::kNamed;
    return identifier("a type", out.name);
  }

  bool constant(Constant& out, int depth) {
    out.span = here();
    if (depth > kSyntaxNestingMax) return error(out.span, "idl.too-deep", "constants are nested too deeply");
    switch (token_.form) {
      case Form::kInt: out.integer = token_.integer; return advance();
      case Form::kDouble:
        out.form = Constant::Form::kDouble;
        out.real = token_.real;
        return advance();
      case Form::kText:
        out.form = Constant::Form::kText;
        out.text = token_.text;
        return advance();
      case Form::kWord:
        if (is_word("true") || is_word("false")) return integer("a constant", out.integer);
        out.form = Constant::Form::kName;
        return identifier("a constant", out.text);
      case Form::kSymbol: break;
      case Form::kEnd: return expected("a constant");
    }
    if (is_symbol('[')) {
      out.form = Constant::Form::kList;
      if (!advance()) return false;
      while (!is_symbol(']')) {
        if (!constant(out.items.emplace_back(), depth + 1) || !skip_separator()) return false;
      }
      return advance();
    }
    if (is_symbol('{')) {
      out.form = Constant::Form::kMap;
      if (!advance()) return false;
      while (!is_symbol('}')) {
        if (!constant(out.items.emplace_back(), depth + 1) || !symbol(':')) return false;
        if (!constant(out.items.emplace_back(), depth + 1) || !skip_separator()) return false;
      }
      return advance();
    }
    return expected("a constant");
  }

  Lexer lexer_;
  LineIndex lines_;
  const std::string& file_;
  File& out_;
  Diagnostics& diagnostics_;
  Token token_;
};

}  // namespace

bool parse(std::string_view source, const std::string& file, File& out, Diagnostics& diagnostics) {
  return Parser(source, file, out, diagnostics).parse();
}

}  // namespace sentree::idl::syntax
