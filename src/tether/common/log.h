#pragma once

#include <string_view>

namespace tether {

/// Messages for people go to standard error. Off until SetVerbose(true); warnings always show.
void SetVerbose(bool verbose);
void LogDebug(std::string_view message);
void LogWarning(std::string_view message);

}  // namespace tether
