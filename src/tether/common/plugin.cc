#include "tether/common/plugin.h"

#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <dlfcn.h>

#include "tether/common/error.h"

namespace tether {
namespace {

namespace fs = std::filesystem;

std::optional<fs::path> FindPlugin(const std::string& name) {
  std::vector<fs::path> folders;
  std::error_code failed;
  const fs::path executable = fs::read_symlink("/proc/self/exe", failed);
  if (!failed) folders.push_back(executable.parent_path() / "../lib/tether");
  folders.emplace_back(TETHER_INSTALLED_PLUGINS);
  folders.emplace_back(TETHER_BUILT_PLUGINS);
  for (const fs::path& folder : folders) {
    const fs::path file = folder / ("tether_" + name + ".so");
    if (fs::exists(file, failed)) return file;
  }
  return std::nullopt;
}

}  // namespace

bool HasPlugin(const std::string& name) { return FindPlugin(name).has_value(); }

void* LoadPlugin(const std::string& name, const std::string& symbol, const std::string& remedy) {
  // Loaded once: a solver asks before every solve.
  static std::mutex mutex;
  static std::map<std::pair<std::string, std::string>, void*> loaded;
  const std::lock_guard lock(mutex);
  void*& function = loaded[{name, symbol}];
  if (function != nullptr) return function;
  const auto file = FindPlugin(name);
  if (!file) throw InputError("this build of Tether has no plugin '" + name + "'", remedy);
  void* library = dlopen(file->c_str(), RTLD_LAZY | RTLD_LOCAL);
  function = library != nullptr ? dlsym(library, symbol.c_str()) : nullptr;
  if (function == nullptr) {
    const char* reason = dlerror();
    throw InputError("the plugin '" + name + "' of Tether can't be loaded: " + (reason ? reason : symbol),
                     remedy);
  }
  return function;
}

}  // namespace tether
