#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace tether::evaluation {

/// Where a run's log goes, and what it says of its origin.
struct LogSettings {
  std::string path;                          ///< Empty: no log.
  std::map<std::string, std::string> files;  ///< What the run was made of, by path: kept in the log.
  uint64_t seed = 0;
  std::string goal = {}, semantics = {};  ///< Of a temporal goal in place of the scenario's; else empty.
};

}  // namespace tether::evaluation
