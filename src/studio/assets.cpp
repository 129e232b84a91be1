#include "sentree/studio/assets.h"

namespace sentree::studio {

#ifdef SENTREE_HAS_PAGE
std::span<const Asset> assets() { return embedded_assets(); }
#else
std::span<const Asset> assets() { return {}; }
#endif

}  // namespace sentree::studio
