#pragma once

#include <string>
#include <vector>

namespace tether::task {

/// Why a skeleton has no key poses: what the geometric side tells the search.
struct Conflict {
  enum class Kind {
    kProved,  ///< No key poses exist.
    kGaveUp,  ///< None were found; others might find some.
  };

  Kind kind = Kind::kGaveUp;
  std::vector<int> prefix;  ///< Actions, indices into Task::actions(): every skeleton that begins so fails.
  /// The last action of `prefix` fails by itself, whatever comes before it: so does every skeleton with it.
  bool anywhere = false;
  /// If not empty, the same, but only unless one of these actions comes before it: what they move is why it
  /// fails.
  std::vector<int> unless;
  std::vector<int> steps;                ///< Indices into `prefix` of the actions that clash; may be empty.
  std::vector<std::string> constraints;  ///< What can't hold together, in words.
  std::string reason;                    ///< One sentence for people.

  /// No sequence that begins with these actions can do.
  bool RulesOut(const std::vector<int>& actions) const;
};

}  // namespace tether::task
