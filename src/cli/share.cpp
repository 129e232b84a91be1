#include "sentree/cli/share.h"

#include <fmt/format.h>

#include "sentree/campaign/statistics.h"
#include "sentree/cli/output.h"

namespace sentree::cli {

std::string as_percent(double share) {
  std::string text = fmt::format("{:g}", share * 100);
  return share < 1 && text == "100" ? fmt::format("{:.15g}", share * 100) : text;
}

std::optional<double> share(const std::string& option, const std::string& text) {
  const auto value = campaign::parse_share(text);
  if (value) return value;
  say(fmt::format("{} {}: a share between 0 and 100 %, such as 1% or 0.01", option, text));
  return std::nullopt;
}

}  // namespace sentree::cli
