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
  std::vector<int> steps;                ///< Indices into `prefix` of the actions that clash; may be empty.
  std::vector<std::string> constraints;  ///< What can't hold together, in words.
  std::string reason;                    ///< One sentence for people.
};

}  // namespace tether::task
