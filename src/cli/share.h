#pragma once

#include <optional>
#include <string>

namespace sentree::cli {

/// "1 %", "1%" or 0.01; nothing (and said) unless it lies between 0 and 1.
[[nodiscard]] std::optional<double> share(const std::string& option, const std::string& text);

/// 0.95 as "95": what is below 100 % is never shown as that.
[[nodiscard]] std::string as_percent(double share);

}  // namespace sentree::cli
