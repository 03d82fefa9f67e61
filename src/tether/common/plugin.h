#pragma once

#include <string>

namespace tether {

/// Whether the plugin `name` was built.
bool HasPlugin(const std::string& name);

/// The function `symbol` of a plugin: a shared object `tether_<name>.so` that links a library
/// which not everyone has or few commands need, opened when it is first asked for and never closed. It is
/// looked for beside the program, in ../lib/tether, then where Tether was installed or built. Throws
/// InputError with `remedy` as what to do if it was not built or can't be loaded. May be called by several
/// threads at once.
void* LoadPlugin(const std::string& name, const std::string& symbol, const std::string& remedy);

}  // namespace tether
