#include "tether/common/version.h"

namespace tether {

std::string Version() {
  std::string build = TETHER_BUILD;
  for (char& c : build) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
#if defined(__clang__)
  const std::string compiler = "clang " __clang_version__;
#else
  const std::string compiler = "g++ " __VERSION__;
#endif
  return std::string(TETHER_VERSION) + " (" + build + ", " + compiler + ")";
}

}  // namespace tether
