#include "tether/task/goal/conflict.h"

#include <algorithm>

namespace tether::task {

bool Conflict::RulesOut(const std::vector<ActionId>& actions) const {
  if (prefix.empty()) return true;
  if (actions.size() >= prefix.size() && std::equal(prefix.begin(), prefix.end(), actions.begin()))
    return true;
  if (!anywhere && unless.empty()) return false;
  const auto end = std::find(actions.begin(), actions.end(), prefix.back());
  return end != actions.end() &&
         std::find_first_of(actions.begin(), end, unless.begin(), unless.end()) == end;
}

}  // namespace tether::task
