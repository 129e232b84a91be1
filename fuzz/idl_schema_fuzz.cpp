// Any text is a schema or a list of errors with places; what loads can be asked for everything it has.

#include <cstdint>
#include <string_view>

#include "sentree/base/assert.h"
#include "sentree/idl/conform.h"
#include "sentree/idl/schema.h"

using namespace sentree;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view source(reinterpret_cast<const char*>(data), size);
  // The file includes itself under other names, as often as it likes.
  const auto loaded = idl::Schema::load(source, "fuzz.thrift",
                                        [&](std::string_view path, std::string_view) -> Result<idl::IncludedFile> {
                                          if (path.size() > 2) return fail("fuzz", "no such file");
                                          return idl::IncludedFile{std::string(path), std::string(source)};
                                        });
  SENTREE_ASSERT(loaded.ok() != has_errors(loaded.diagnostics));
  if (!loaded.ok()) return 0;
  for (const idl::Struct& s : loaded.value->structures()) {
    const auto made = idl::conform(*loaded.value->type(s.name), Value(Map()), "value");
    if (made) SENTREE_ASSERT(idl::conform(*loaded.value->type(s.name), *made, "value") == made);
  }
  for (const idl::Service& service : loaded.value->services()) {
    for (const idl::Method* method : service.methods) SENTREE_ASSERT(!idl::signature(*method).empty());
  }
  return 0;
}
