#pragma once

#include <string>

#include "tether/experiment/scenario.h"

namespace tether::experiment {

inline Scenario Shipped(const std::string& name) {
  return LoadScenario(std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name + ".yaml");
}

}  // namespace tether::experiment
