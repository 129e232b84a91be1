#pragma once

namespace sentree::project {

/// `ServiceEntry::at` of a service that nothing serves and that would answer anything: for who looks at a plan before
/// it is known what that is. No project file has it.
inline constexpr const char* kAnyReply = "any reply";

/// Of the names of models that `sentree verify` makes of such services; what follows is that of the service.
inline constexpr const char* kAnyReplyPrefix = "any_";

}  // namespace sentree::project
