#pragma once

#include <string>
#include <vector>

#include "tether/common/id.h"

namespace tether::task {

/// Why a skeleton has no key poses: feedback from the geometry to the search.
struct Conflict {
  enum class Kind {
    kProved,  ///< No key poses exist.
    kGaveUp,  ///< None were found; others might find some.
  };

  Kind kind = Kind::kGaveUp;
  std::vector<ActionId> prefix;  ///< Every skeleton with this prefix fails.
  /// The last action of `prefix` fails by itself, whatever comes before it: so does every skeleton with it.
  bool anywhere = false;
  /// If not empty, the same, unless one of these actions comes before it: they move what makes it fail.
  std::vector<ActionId> unless;
  std::vector<int> steps;  ///< Indices into `prefix` of the actions that conflict; may be empty.
  std::vector<std::string> constraints;  ///< The constraints that conflict, in words.
  std::string reason;                    ///< One sentence for people.

  /// Whether it excludes every sequence that begins with these actions.
  bool RulesOut(const std::vector<ActionId>& actions) const;
};

}  // namespace tether::task
