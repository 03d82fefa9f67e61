#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/planning/skeleton/action.h"

namespace tether::planning {

/// The `format` of an action library.
inline constexpr const char* kActionsFormat = "tether.actions/1";

/// The names that an action library may use.
struct ActionReadOptions {
  /// Registered constraint kinds; empty: any kind is accepted.
  std::vector<std::string> constraint_kinds;
  /// Frames and regions of the scene that the library is read for. Without them, a name that is not a
  /// parameter is left to the binding.
  std::optional<std::vector<std::string>> frames;
};

/// Reads the actions of a document in format `tether.actions/1`. Every mistake goes to `diagnostics` with its
/// place: unknown keys, verbs, constraint kinds and names with the nearest match, numbers that are not
/// finite, wrong shapes. Actions with mistakes are still returned, as far as they could be read.
std::vector<ActionSchema> ParseActions(const Value& document, const ActionReadOptions& options,
                                       Diagnostics& diagnostics);

/// The same for a file. Throws InputError with all its mistakes, or if it can't be read.
std::vector<ActionSchema> ReadActions(const std::string& path, const ActionReadOptions& options = {});

/// Reads one verb, `{reach: {…}}`, `{shift: {…}}`, `{gripper: {…}}` or `{wait: seconds}`. Empty, with a
/// diagnostic, if it is none of them.
std::optional<Verb> ParseVerb(const Value& value, Diagnostics& diagnostics);

/// The verb as it is written in files; ParseVerb gives back exactly the same verb.
Value WriteVerb(const Verb& verb);

/// Reads a list of `- kind: {parameters}`. `kinds` as in ActionReadOptions; `what` names the list in
/// messages.
std::vector<ConstraintSpec> ParseConstraints(const Value& list, const std::string& what,
                                             const std::vector<std::string>& kinds, Diagnostics& diagnostics);

/// The steps of an action with its parameters replaced by `arguments`: in frames, allowed pairs, verbs, and
/// wherever text inside a constraint's parameters is a parameter's name. Throws InputError if the number of
/// arguments is not that of the parameters.
std::vector<StepSchema> BindAction(const ActionSchema& schema, const std::vector<std::string>& arguments);

}  // namespace tether::planning
