#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tether/common/document/value.h"
#include "tether/constraints/core/context.h"

namespace tether::constraints {

/// One parameter of a kind, with what its reference page says of it.
struct ParameterDoc {
  enum class Type { kFrame, kFramePair, kNumber, kText };
  std::string name;
  Type type = Type::kFrame;
  bool required = true;
  double default_number = 0;
  double lower = 0, upper = 0;        ///< Bounds of a number.
  std::vector<std::string> accepted;  ///< Of a text; the first is the default.
  std::string doc;                    ///< With the unit.
};

struct Kind;

/// The parameters of one constraint, read and checked against its kind.
class Parameters {
 public:
  const std::string& Text(const std::string& name) const { return texts_.at(name); }
  double Number(const std::string& name) const { return numbers_.at(name); }
  /// Of a frame, and of a pair of frames; not valid where an optional one is not given. After BindFrames().
  FrameId Frame(const std::string& name) const { return frame_ids_.at(name); }
  const std::vector<FrameId>& Frames(const std::string& name) const { return pair_ids_.at(name); }
  /// Every frame that is named, in the order of the kind's parameters.
  std::vector<std::string> AllFrames() const;
  /// Looks its frames up. A name that is not among `frames` gives one that is not valid; "moved" is `moved`.
  void BindFrames(const scene::Frames& frames, FrameId moved);

 private:
  friend Parameters ReadParameters(const Kind& kind, const Value& value, Diagnostics& diagnostics);

  std::map<std::string, std::string> texts_;  // frames and texts
  std::map<std::string, double> numbers_;
  std::map<std::string, std::vector<std::string>> frames_;
  std::vector<std::string> frame_order_;
  std::map<std::string, FrameId> frame_ids_;
  std::map<std::string, std::vector<FrameId>> pair_ids_;
};

/// A set of points: those within `radius` of an axis and within `half_height` of its centre along it, m.
struct Column {
  Eigen::Vector3d centre;
  Eigen::Vector3d axis;  ///< Unit.
  double radius;
  double half_height;
};

/// Unit vectors, fixed in the control and in the target frame, that have the same direction.
struct Alignment {
  Eigen::Vector3d of_control;
  Eigen::Vector3d of_target;
};

/// A registered kind of constraint: its name and parameters, its rows for an optimiser, its initial guess,
/// and a geometric test that shares no code with the rows.
struct Kind {
  std::string name;
  std::string summary;
  std::string source;  ///< "Paper A, eq. (8); ERRATA A12", or "ours".
  std::vector<ParameterDoc> parameters;

  /// Moves the guess of the control frame in the target frame to where the constraint is likely to hold. May
  /// be empty.
  std::function<void(const Context&, const Parameters&, math::Pose& X_TC)> guess;
  /// Adds the rows. May refute the step, with a reason.
  std::function<void(const Context&, const Parameters&, RowSink&)> build;
  /// Judges the poses that `context` holds, geometrically.
  std::function<void(const Context&, const Parameters&, Findings&)> check;
  /// The set in which the origin of the control frame must be, in the target frame, where the constraint
  /// holds, whatever the poses: for bounds on the cost. None if nothing is known. May be empty.
  std::function<std::optional<Column>(const Context&, const Parameters&)> locate = nullptr;
  /// Directions that must agree where the constraint holds, whatever the poses: for proofs that the arm is
  /// too short. None if nothing is known. May be empty.
  std::function<std::optional<Alignment>(const Context&, const Parameters&)> align = nullptr;
};

/// Every kind, in alphabetical order. Adding one means adding it here: name, parameters, bounds,
/// documentation and code in one place.
const std::vector<Kind>& Registry();
/// The kind of this name, or null.
const Kind* FindKind(const std::string& name);
std::vector<std::string> KindNames();

/// Reads the parameters of a constraint of this kind. Adds to `diagnostics` what is unknown, missing, of the
/// wrong type or out of bounds; unknown keys with the nearest match.
Parameters ReadParameters(const Kind& kind, const Value& value, Diagnostics& diagnostics);

/// The reference page of all kinds, in Markdown.
std::string RegistryReference();

}  // namespace tether::constraints
