#pragma once

#include <string>

namespace tether {

/// Version and build, such as "0.1.0 (release, g++ 12.2.0)": the origin that every output names.
std::string Version();

}  // namespace tether
