#pragma once

#include <string>

namespace tether {

/// Version and build, such as "0.1.0 (release, g++ 12.2.0)": what every output says made it.
std::string Version();

}  // namespace tether
