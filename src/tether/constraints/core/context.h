#pragma once

#include <compare>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tether/common/id.h"
#include "tether/constraints/core/numbers.h"
#include "tether/constraints/core/pose_function.h"
#include "tether/geometry/shape.h"
#include "tether/robot/model.h"
#include "tether/scene/frames.h"
#include "tether/scene/scene.h"

namespace tether::constraints {

struct KnownOfProgram;
struct KnownOfScene;

using scene::kHand;
/// In a constraint that holds at every step: the frame that the step moves.
inline constexpr const char* kMoved = "moved";

/// A frame as it stands after a key pose. Step −1 is the start.
struct FrameAt {
  FrameId frame;
  int step = -1;
};

/// A discrete choice that a constraint leaves, in the order of its step.
struct ChoiceKey {
  enum class Kind {
    kContact,  ///< Where the frame, a tool, touches the other.
    kFace,     ///< Which of its faces the other carries the frame on.
    kGrasp,    ///< How the frame is grasped.
    kTurn,     ///< How the frame is turned as it is put down.
  };
  Kind kind = Kind::kGrasp;
  FrameId frame, other;
  int step = -1;

  auto operator<=>(const ChoiceKey&) const = default;
};

/// An option of such a choice: which part to grasp, which face to push.
struct Option {
  std::string label;
  double score = 0;  ///< About what it adds to the cost of a plan; lower is tried first.
};

/// What a constraint sees when its rows are built, or its test is made, at one step of a skeleton: a view
/// that planning implements.
class Context {
 public:
  virtual ~Context() = default;

  /// Index of the present step, and its control and target frame.
  virtual int step() const = 0;
  virtual FrameId control() const = 0;
  virtual FrameId target() const = 0;
  virtual const scene::Scene& scene() const = 0;
  virtual const scene::Frames& frames() const = 0;
  /// Null when planning without a robot.
  virtual const robot::Model* robot() const = 0;
  /// The robot's base in the world; identity without a robot.
  virtual math::Pose X_WBase() const = 0;
  /// The solid of an object or of the hand (open); null for regions and the world.
  virtual const geometry::Shape* ShapeOf(FrameId frame) const = 0;
  /// Pose in the world: while building, of the guess so far; while judging, of the plan.
  virtual math::Pose PoseAt(const FrameAt& frame) const = 0;
  /// The frame that an object is attached to after the present step: what it was last put down on, or its
  /// parent at the start.
  virtual FrameId ParentOf(FrameId object) const = 0;
  /// Unit vector, in the object's frame, of the outward normal of the face that it stands on or last stood
  /// on.
  virtual Eigen::Vector3d DownFace(FrameId object) const = 0;
  /// The approach of the present step's grasp: "down", or what a `graspable` of that step says.
  virtual const std::string& approach() const = 0;
  /// The force with which the present step's verbs close the fingers on this object, N at each pad; none if
  /// they don't.
  virtual std::optional<double> grip_force(FrameId object) const = 0;
  /// How far inside an object the hand's origin has to be at the present step, m; none if that is not asked.
  virtual std::optional<double> grip_margin(FrameId object) const = 0;
  /// The index of the option chosen; the same key gives the same answer within one program. `options` must
  /// not be empty.
  virtual int Choose(const ChoiceKey& key, const std::vector<Option>& options) const = 0;
  virtual const KnownOfScene& known() const = 0;
  virtual const KnownOfProgram& known_of_program() const = 0;

  FrameId hand() const { return frames().hand(); }
  const std::string& Name(FrameId frame) const { return frames().Name(frame); }
  /// Null if the frame is no object's.
  const scene::Object* ObjectAt(FrameId frame) const {
    const ObjectId object = frames().ObjectOf(frame);
    return object.valid() ? &scene().object(object) : nullptr;
  }
  /// Null if the frame is no region's.
  const scene::Region* RegionAt(FrameId frame) const {
    const int region = frames().RegionOf(frame);
    return region >= 0 ? &scene().regions[ToIndex(region)] : nullptr;
  }
};

/// Receives the rows that a constraint adds to a program.
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// `function` over the poses of `frames` must be zero (equality) or not above zero (inequality), row by
  /// row.
  virtual void Add(nlp::Role role, const std::string& label, PoseFunctionPtr function,
                   std::vector<FrameAt> frames) = 0;
  /// This pair touches on purpose at that step: it gets no collision row (ERRATA A12). With `part_a` ≥ 0 only
  /// that part of `a`.
  virtual void Exempt(int step, FrameId a, FrameId b, int part_a = -1) = 0;
  /// No pose can satisfy the constraint, whatever the choices and the earlier steps: a proof.
  virtual void Refute(const std::string& reason) = 0;
  /// No pose is looked for, although there may be one: the constraint has no rows for this case, or not
  /// everything that it allows is tried.
  virtual void Decline(const std::string& reason) = 0;
};

/// Receives what a geometric test finds.
class Findings {
 public:
  virtual ~Findings() = default;
  /// `amount` ≤ 0 holds; above zero it is the violation, in metres or radians. `cause`, if given, is called
  /// only then, and returns what is wrong as a phrase that can follow the action's name: "a leans by 3
  /// degrees on b".
  template <typename Cause>
  void Report(const std::string& label, nlp::Unit unit, double amount, const Cause& cause) {
    Take(label, unit, amount, amount <= 0 ? std::string() : std::string(cause()));
  }
  void Report(const std::string& label, nlp::Unit unit, double amount) { Take(label, unit, amount, {}); }

 protected:
  virtual void Take(const std::string& label, nlp::Unit unit, double amount, std::string cause) = 0;
};

}  // namespace tether::constraints
