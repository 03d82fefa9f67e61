#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tether/common/error.h"
#include "tether/robot/model.h"

namespace tether::robot {

std::string DataDirectory() {
  namespace fs = std::filesystem;
  const auto holds_models = [](const fs::path& folder) {
    std::error_code ignored;
    return fs::is_directory(folder / "models", ignored);
  };
  if (const char* set = std::getenv("TETHER_DATA_DIR"); set != nullptr && *set != '\0') {
    if (holds_models(set)) return set;
    throw InputError("TETHER_DATA_DIR is '" + std::string(set) + "', which has no folder 'models'",
                     "the folder that holds Tether's models/ and scenarios/ is accepted");
  }
  std::error_code failed;
  const fs::path executable = fs::read_symlink("/proc/self/exe", failed);
  std::vector<fs::path> candidates;
  if (!failed) {
    const fs::path bin = executable.parent_path();
    // As installed, and from build/<preset>/bin in a source tree.
    candidates = {bin / "../share/tether", bin / "../../.."};
  }
  candidates.emplace_back(TETHER_SOURCE_DATA_DIR);
  for (const fs::path& candidate : candidates) {
    if (holds_models(candidate)) return fs::weakly_canonical(candidate).string();
  }
  throw InputError("Tether's data (the folders models/ and scenarios/) isn't beside the program",
                   "set the environment variable TETHER_DATA_DIR to the folder that holds them");
}

}  // namespace tether::robot
