#include "sentree/studio/assets.h"

namespace sentree::studio {

std::span<const Asset> assets() { return {}; }

}  // namespace sentree::studio
