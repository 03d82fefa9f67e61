#pragma once

#include <string>

#include "tether/scenario/scenario.h"

namespace tether::scenario {

inline Scenario Shipped(const std::string& name) {
  return LoadScenario(std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name + ".yaml");
}

/// The text with every occurrence of a piece removed, such as the path of a test's folder.
inline std::string Without(std::string text, const std::string& piece) {
  for (size_t at = 0; (at = text.find(piece, at)) != std::string::npos;) text.erase(at, piece.size());
  return text;
}

}  // namespace tether::scenario
