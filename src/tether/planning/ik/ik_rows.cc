#include "tether/planning/ik/ik_rows.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "tether/constraints/core/arm_function.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/planning/ik/approach_check.h"
#include "tether/planning/program/chain_residual.h"

namespace tether::planning {
namespace {

using math::Pose;
using nlp::Role;

// Links that come this near to what they have to keep clear of get a row, m beyond the clearance.
constexpr double kNearLink = 0.03;
// Weight of the joints' distance from the search's best, per rad²: tiny, but it gives curvature to the
// elbow's redundancy.
constexpr double kStay = 1e-4;
// Along a straight motion no joint turns further than this, rad and rad per m.
constexpr double kLeastTurn = 0.15;
constexpr double kTurnPerLength = 4;
// Beyond this error of the hand no joint variables are added, m and rad together.
constexpr double kHopeless = 0.5;

/// √weight · (q − rest).
class StayNear final : public nlp::Residual {
 public:
  StayNear(int step, int vector, Eigen::VectorXd rest)
      : Residual("joints stay near", step, static_cast<int>(rest.size()), nlp::Unit::kRadian,
                 {{nlp::BlockRef::Kind::kVector, vector}}),
        rest_(std::move(rest)) {}

  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    const double weight = std::sqrt(kStay);
    r = weight * (x.vectors[blocks()[0].index] - rest_);
    if (J == nullptr) return;
    J->setZero();
    J->diagonal().array() = weight;
  }

 private:
  Eigen::VectorXd rest_;
};

/// |q_a − q_b| less `most`, rad: 2n rows, for two vector blocks.
class StayClose final : public nlp::Residual {
 public:
  StayClose(std::string name, int step, int a, int b, int dof, double most)
      : Residual(std::move(name), step, 2 * dof, nlp::Unit::kRadian,
                 {{nlp::BlockRef::Kind::kVector, a}, {nlp::BlockRef::Kind::kVector, b}}),
        dof_(dof),
        most_(most) {}

  void Evaluate(const nlp::Point& x, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    const Eigen::VectorXd &a = x.vectors[blocks()[0].index], &b = x.vectors[blocks()[1].index];
    for (int i = 0; i < dof_; ++i) {
      r[2 * i] = a[i] - b[i] - most_;
      r[2 * i + 1] = b[i] - a[i] - most_;
    }
    if (J == nullptr) return;
    J->setZero();
    for (int i = 0; i < dof_; ++i) {
      (*J)(2 * i, i) = (*J)(2 * i + 1, dof_ + i) = 1;
      (*J)(2 * i + 1, i) = (*J)(2 * i, dof_ + i) = -1;
    }
  }

 private:
  int dof_;
  double most_;
};

class RowWriter {
 public:
  RowWriter(const SceneFacts& facts, const std::vector<BoundStep>& steps, KeyPoseProgram& key_poses)
      : facts_(facts), steps_(steps), key_poses_(key_poses), model_(facts.problem().robot.model) {}

  /// The joints at a step, or at the far end of its approach or retreat.
  JointBlock& AddBlock(int step, const robot::PostureProblem& problem, const Eigen::VectorXd& q,
                       bool far = false, const constraints::Offset& offset = {}) {
    const std::string& robot = facts_.problem().robot.name;
    const nlp::BlockRef block =
        key_poses_.program.AddVector(ActionOf(step) + ": joints of " + robot, problem.lower, problem.upper);
    JointBlock joints{step, block.index, far, {}};
    Add(joints, Role::kEquality, "hand of " + robot, constraints::MakeHandPosition(model_, offset),
        {facts_.hand()});
    Add(joints, Role::kEquality, "turn of the hand of " + robot, constraints::MakeHandRotation(model_),
        {facts_.hand()});
    key_poses_.program.Add(std::make_shared<StayNear>(step, block.index, q), Role::kCost);
    key_poses_.joints.push_back(std::move(joints));
    return key_poses_.joints.back();
  }

  /// No joint turns too far between the two ends of a straight motion.
  void Tie(int step, int vector_a, int vector_b, double length) {
    key_poses_.program.Add(std::make_shared<StayClose>(
                               ActionOf(step) + ": joints on the way of " + facts_.problem().robot.name, step,
                               vector_a, vector_b, model_->dof(), kLeastTurn + kTurnPerLength * length),
                           Role::kInequality);
  }

  /// Adds rows for pairs that are near at `q` and have none. True if there were any.
  bool AddNear(JointBlock& joints, const IkSearch& search, const robot::PostureProblem& problem,
               const Eigen::VectorXd& q) {
    const robot::ArmSolids& solids = model_->solids();
    const robot::LinkPoses links(model_->chain(), q);
    const geometry::Shape hand = model_->HandShape(model_->gripper().max_opening);
    const auto shape = [&](int solid) -> const geometry::Shape& {
      return solid == solids.hand() ? hand : solids.links[ToIndex(solid)].shape;
    };
    const auto box = [&](int solid, size_t part) {
      const geometry::Part& found = shape(solid).parts[part];
      const Pose& X_BS =
          solid == solids.hand() ? links.X_BH() : links.X_BL(solids.links[ToIndex(solid)].link);
      return geometry::BoundingBox(found.primitive, X_BS * found.X_SP);
    };
    const double near = kLinkClearance + kNearLink;
    const size_t before = joints.rows.size();
    for (int solid = 0; solid < solids.hand(); ++solid) {
      const robot::LinkSolid& link = solids.links[ToIndex(solid)];
      for (size_t part = 0; part < link.shape.parts.size(); ++part) {
        const geometry::Aabb own = box(solid, part);
        for (size_t k = 0; k < problem.obstacles.size(); ++k) {
          const robot::PostureObstacle& obstacle = problem.obstacles[k];
          const auto& ignored = obstacle.ignored;
          if ((obstacle.still && link.link == 0) || own.DistanceTo(obstacle.box) > near ||
              std::find(ignored.begin(), ignored.end(), solid) != ignored.end())
            continue;
          const IkSearch::ObstacleName& name = search.NameOf(static_cast<int>(k));
          if (!joints.rows.insert({solid, static_cast<int>(part), 0, name.solid.value(), name.part}).second)
            continue;
          const FrameId object = name.solid;
          Add(joints, Role::kInequality, "clearance(" + link.name + ", " + facts_.Name(object) + ")",
              constraints::MakeLinkClearance(model_, solid, static_cast<int>(part),
                                             facts_.ShapeOf(object)->parts[ToIndex(name.part)],
                                             kLinkClearance),
              {object});
        }
      }
    }
    for (const auto& [a, b] : solids.pairs) {
      for (size_t i = 0; i < shape(a).parts.size(); ++i) {
        for (size_t j = 0; j < shape(b).parts.size(); ++j) {
          const int part_a = static_cast<int>(i), part_b = static_cast<int>(j);
          if (box(a, i).DistanceTo(box(b, j)) > near || !joints.rows.insert({a, part_a, 1, b, part_b}).second)
            continue;
          Add(joints, Role::kInequality, "clearance of the arm from itself",
              constraints::MakeSelfClearance(model_, a, part_a, b, part_b, kLinkClearance), {});
        }
      }
    }
    return joints.rows.size() > before;
  }

 private:
  const std::string& ActionOf(int step) const { return steps_[ToIndex(step)].action; }

  void Add(const JointBlock& joints, Role role, const std::string& label,
           constraints::ArmFunctionPtr function, const std::vector<FrameId>& frames) {
    std::vector<Chain> chains{key_poses_.tree.ChainTo(facts_.base(), joints.step)};
    for (const FrameId frame : frames) chains.push_back(key_poses_.tree.ChainTo(frame, joints.step));
    key_poses_.program.Add(MakeArmResidual(ActionOf(joints.step) + ": " + label, joints.step,
                                           std::move(function), std::move(chains), joints.vector),
                           role);
  }

  const SceneFacts& facts_;
  const std::vector<BoundStep>& steps_;
  KeyPoseProgram& key_poses_;
  std::shared_ptr<const robot::Model> model_;
};

}  // namespace

bool NeedsIkSolutions(const Problem& problem) { return problem.robot.model != nullptr; }

void FindIkSolutions(const SceneFacts& facts, const std::vector<BoundStep>& steps, const nlp::Point& x,
                     KeyPoseProgram& key_poses) {
  if (!NeedsIkSolutions(facts.problem())) return;
  IkSearch search(facts, key_poses.tree);
  for (const JointBlock& joints : key_poses.joints) {
    if (!joints.far && ToIndex(joints.vector) < x.vectors.size())
      search.Suggest(joints.step, x.vectors[ToIndex(joints.vector)]);
  }
  std::vector<IkSolution>& ik_solutions = key_poses.ik_solutions;
  ik_solutions = search.Find(key_poses.tree, x.poses);
  if (!std::all_of(ik_solutions.begin(), ik_solutions.end(),
                   [](const IkSolution& ik_solution) { return ik_solution.found; }))
    return;
  for (size_t t = 0; t < ik_solutions.size(); ++t) {
    ik_solutions[t].problem =
        CheckApproaches(facts, steps, key_poses.tree, x.poses, static_cast<int>(t), search, ik_solutions[t]);
  }
}

bool AddMissingIkSolutions(const SceneFacts& facts, const std::vector<BoundStep>& steps, const nlp::Point& x,
                           KeyPoseProgram& key_poses) {
  if (!NeedsIkSolutions(facts.problem())) return false;
  FindIkSolutions(facts, steps, x, key_poses);
  if (AllHaveIkSolutions(facts, key_poses)) return false;
  IkSearch search(facts, key_poses.tree);
  RowWriter writer(facts, steps, key_poses);
  bool added = false;  // Where only an approach or retreat is not free, none are.
  nlp::Point guess{x.poses, x.vectors, {}};
  for (const IkSolution& ik_solution : key_poses.ik_solutions) {
    const robot::Posture& posture = ik_solution.posture;
    if (!ik_solution.found && posture.position_error + posture.rotation_error > kHopeless) return false;
  }
  const auto find = [&](int step, bool far) {
    return std::find_if(key_poses.joints.begin(), key_poses.joints.end(),
                        [&](const JointBlock& joints) { return joints.step == step && joints.far == far; });
  };
  // The vector block of a step's joints; with rows for what is near them.
  const auto joints_at = [&](int t) {
    const Eigen::VectorXd& q = key_poses.ik_solutions[ToIndex(t)].q;
    search.SetStep(key_poses.tree, x.poses, t);
    auto known = find(t, false);
    if (known == key_poses.joints.end()) {
      JointBlock& joints = writer.AddBlock(t, search.problem(), q);
      guess.vectors.push_back(q);
      writer.AddNear(joints, search, search.problem(), q);
      added = true;
      return joints.vector;
    }
    const Eigen::VectorXd& present = guess.vectors[ToIndex(known->vector)];
    added = writer.AddNear(*known, search, search.problem(), present) || added;
    return known->vector;
  };
  for (int t = 0; t < static_cast<int>(key_poses.ik_solutions.size()); ++t) {
    const IkSolution& ik_solution = key_poses.ik_solutions[ToIndex(t)];
    if (!ik_solution.found) joints_at(t);
    if (!ik_solution.blocked || find(t, true) != key_poses.joints.end()) continue;
    const int here = joints_at(t);
    const ApproachEnd& end = *ik_solution.blocked;
    if (end.at_step_before) {
      writer.Tie(t, here, joints_at(t - 1), end.length);
      continue;
    }
    const int there = writer.AddBlock(t, search.problem(), ik_solution.q, true, end.offset).vector;
    guess.vectors.push_back(ik_solution.q);
    writer.Tie(t, here, there, end.length);
    added = true;
  }
  guess.parameters = key_poses.tree.parameters();
  if (added) key_poses.guess = std::move(guess);
  return added;
}

bool AllHaveIkSolutions(const SceneFacts& facts, const KeyPoseProgram& key_poses) {
  if (!NeedsIkSolutions(facts.problem())) return true;
  return static_cast<int>(key_poses.ik_solutions.size()) == key_poses.tree.num_steps() &&
         std::all_of(
             key_poses.ik_solutions.begin(), key_poses.ik_solutions.end(),
             [](const IkSolution& ik_solution) { return ik_solution.found && ik_solution.problem.empty(); });
}

}  // namespace tether::planning
