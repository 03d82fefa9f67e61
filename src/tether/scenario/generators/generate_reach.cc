#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "tether/math/infinity.h"
#include "tether/scenario/generators/generate_draft.h"

namespace tether::scenario {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kGap = 0.03;         // between things, m
constexpr double kEdge = 0.03;        // to the table's edge, m
constexpr double kRobotRadius = 0.2;  // kept free about the robot's base, m
constexpr double kHandRadius = 0.8;   // how far the hand gets, straight down at the table's height, m
constexpr double kHoldRadius = 0.78;  // how far it has to get at most with the hook behind the box, m
constexpr double kHoldEnd = 0.01;     // from the end of the handle, m
constexpr int kDraws = 1000;

const char* const kDomain = R"(; Reach a box beyond the arm's workspace by pulling it closer with a hook.
(define (domain reach)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions)
  (:types
    physobj - object
    movable - physobj)
  (:constants table - physobj)
  (:predicates
    (inhand ?a - movable)             ; the hand holds a
    (on ?a - movable ?b - physobj)    ; a rests on b
    (inworkspace ?a - physobj))       ; the hand reaches a

  (:action pick
    :parameters (?a - movable)
    :precondition (and
      (forall (?b - movable) (not (inhand ?b)))
      (inworkspace ?a))
    :effect (and
      (inhand ?a)
      (forall (?b - physobj) (not (on ?a ?b)))))

  (:action place
    :parameters (?a - movable ?b - physobj)
    :precondition (and
      (not (= ?a ?b))
      (inhand ?a)
      (inworkspace ?b))
    :effect (and
      (not (inhand ?a))
      (on ?a ?b)))

  ; With a in the hand, push b over c to where the hand reaches it.
  (:action push
    :parameters (?a ?b - movable ?c - physobj)
    :precondition (and
      (not (= ?a ?b))
      (not (= ?a ?c))
      (not (= ?b ?c))
      (inhand ?a)
      (on ?b ?c)
      (inworkspace ?c))
    :effect (inworkspace ?b)))
)";

std::string WriteProblem(bool within) {
  return std::string("; The box is to stand on the shelf; it is ") + (within ? "within" : "out of") +
         " reach.\n(define (problem put-box-on-shelf)\n  (:domain reach)\n  (:objects\n    shelf - physobj\n"
         "    hook box - movable)\n  (:init\n    (inworkspace table) (inworkspace shelf) (inworkspace hook)" +
         (within ? " (inworkspace box)" : "") +
         "\n    (on hook table) (on box table))\n  (:goal (and\n    (not (inhand hook))\n"
         "    (not (inhand box))\n    (on box shelf))))\n";
}

void PlaceAt(DraftObject& object, double radius, double bearing) {
  object.p_W.x() = OnGrid(radius * std::cos(bearing), 0.001);
  object.p_W.y() = OnGrid(radius * std::sin(bearing), 0.001);
}

double DrawYaw(Random& random, double about, double spread) {
  return OnGrid(about + random.Uniform(-spread, spread), 1e-4);
}

/// A hook like a hockey stick, lying: the handle along x at one side, the head along y.
DraftObject DrawHook(Random random) {
  const double radius = DrawLength(random, 0.010, 0.013);
  const double handle = DrawLength(random, 0.22, 0.30);
  const double head = DrawLength(random, 0.08, 0.12);
  const double side = random.Index(2) == 0 ? 0.5 : -0.5;
  DraftObject hook;
  hook.name = "hook";
  // The frame's origin lies in the middle of the head, 3.5 cm towards the handle.
  const double head_x = 0.035;
  hook.shape = geometry::Shape(std::vector<geometry::Part>{
      {geometry::Capsule{radius, handle},
       {math::RotationFromRpy({0, 0.5 * kPi, 0}), {OnGrid(head_x - 0.5 * handle, 1e-4), side * head, 0}}},
      {geometry::Capsule{radius, head}, {math::RotationFromRpy({0.5 * kPi, 0, 0}), {head_x, 0, 0}}}});
  hook.p_W.z() = radius;
  hook.mass = 0.1;
  hook.colour = 3;
  hook.remark = "the handle along x at one side, the head along y";
  return hook;
}

double HandleLength(const DraftObject& hook) {
  return std::get<geometry::Capsule>(hook.shape.parts.front().primitive).length;
}

/// Every point of the object is at least kEdge from the table's edge, and outside of the robot's base.
bool IsOverTable(const DraftObject& object, const DraftObject& table) {
  DraftObject base;
  base.shape = geometry::Shape(geometry::Cylinder{kRobotRadius, 1});
  SceneDraft robot;
  robot.objects = {base};
  if (!robot.IsClear(object, 0, {})) return false;
  const Eigen::Vector3d size = std::get<geometry::Box>(table.shape.parts.front().primitive).size;
  for (const geometry::Part& part : object.shape.parts) {
    const math::Pose X_WP = object.X_WO() * part.X_SP;
    for (int i = 0; i < 2; ++i) {
      double extent = 0;  // of the part along this axis of the world
      if (const auto* box = std::get_if<geometry::Box>(&part.primitive)) {
        extent = 0.5 * X_WP.R.row(i).cwiseAbs().dot(box->size);
      } else {
        const auto& capsule = std::get<geometry::Capsule>(part.primitive);
        extent = 0.5 * capsule.length * std::abs(X_WP.R(i, 2)) + capsule.radius;
      }
      if (std::abs(X_WP.p[i] - table.p_W[i]) + extent > 0.5 * size[i] - kEdge) return false;
    }
  }
  return true;
}

/// How far the hand is from the base's axis, at the least, while it holds the handle at its end and the head
/// lies behind a side of the box.
double HoldRadius(const DraftObject& box, const DraftObject& hook) {
  const Eigen::Vector3d size = std::get<geometry::Box>(box.shape.parts.front().primitive).size;
  const geometry::Part& handle = hook.shape.parts.front();
  const auto& rod = std::get<geometry::Capsule>(handle.primitive);
  const double head_x = hook.shape.parts.back().X_SP.p.x();
  // In the hook's frame, turned so that x points out of the side.
  const Eigen::Vector3d p_HeadHold(handle.X_SP.p.x() - 0.5 * rod.length + kHoldEnd - head_x,
                                   handle.X_SP.p.y(), 0);
  double least = math::kInfinity;
  for (int side = 0; side < 4; ++side) {
    const Eigen::Matrix3d R = math::RotationFromRpy({0, 0, box.yaw + 0.5 * kPi * side});
    const Eigen::Vector3d p_WHead = box.p_W + R.col(0) * (0.5 * size[side % 2] + rod.radius);
    least = std::min(least, (p_WHead + R * p_HeadHold).head<2>().norm());
  }
  return least;
}

/// Places box, shelf and hook one after another. False if there is no room for one of them.
bool PlaceAll(Random random, bool within, const DraftObject& drawn_hook, SceneDraft& draft) {
  const DraftObject table = draft.objects.front();
  Random boxes = random.Split("box"), shelves = random.Split("shelf"), hooks = random.Split("hook");
  DraftObject box = DrawBox(boxes, "box", 0.04, 0.06);
  const double farthest = 0.76 + 0.75 * HandleLength(drawn_hook);
  const double bearing = within ? boxes.Uniform(-0.8, 0.8) : boxes.Uniform(-0.4, 0.4);
  PlaceAt(box, within ? boxes.Uniform(0.40, 0.72) : boxes.Uniform(0.84, farthest), bearing);
  box.yaw = within ? DrawYaw(boxes, 0, kPi) : DrawYaw(boxes, bearing + 0.5 * kPi * boxes.Index(4), kPi / 6);
  box.colour = 2;
  if (!IsOverTable(box, table) || (!within && HoldRadius(box, drawn_hook) > kHoldRadius)) return false;
  draft.objects.push_back(box);

  const auto place = [&](DraftObject object, double gap, const auto& draw) {
    for (int i = 0; i < kDraws; ++i) {
      if (!draw(object) || !IsOverTable(object, table) || !draft.IsClear(object, gap, {"table"})) continue;
      draft.objects.push_back(object);
      return true;
    }
    return false;
  };
  DraftObject shelf;
  shelf.name = "shelf";
  const Eigen::Vector3d size(DrawLength(shelves, 0.20, 0.32), DrawLength(shelves, 0.20, 0.32),
                             DrawLength(shelves, 0.04, 0.16));
  shelf.shape = geometry::Shape(geometry::Box{size});
  shelf.p_W.z() = 0.5 * size.z();
  shelf.colour = 9;
  const bool has_shelf = place(shelf, 0.08, [&](DraftObject& object) {
    const double about = shelves.Uniform(-1.1, 1.1);
    PlaceAt(object, shelves.Uniform(0.40, 0.60), about);
    object.yaw = DrawYaw(shelves, 0, 0.3);
    return std::abs(about - bearing) > 0.6;  // it does not wall off the box
  });
  return has_shelf && place(drawn_hook, kGap, [&](DraftObject& object) {
           // The hand can grasp the middle of the handle.
           const double radius = hooks.Uniform(0.40, 0.68), about = hooks.Uniform(-1.2, 1.2);
           object.yaw = DrawYaw(hooks, about, kPi / 2);
           const Eigen::Vector3d p_WO =
               Eigen::Vector3d(radius * std::cos(about), radius * std::sin(about), 0) -
               object.X_WO().R * object.shape.parts.front().X_SP.p;
           object.p_W.x() = OnGrid(p_WO.x(), 0.001);
           object.p_W.y() = OnGrid(p_WO.y(), 0.001);
           return true;
         });
}

}  // namespace

GeneratedScenario GenerateReach(uint64_t seed) {
  const Random random = Random(seed).Split("reach");
  Random sizes = random.Split("sizes");
  const bool within = sizes.Uniform(0, 1) < 0.25;
  SceneDraft draft;
  draft.title = "Workspace Reach, seed " + std::to_string(seed);
  draft.command = "tether generate reach --seed " + std::to_string(seed);
  draft.about = within
                    ? "The box is within reach and goes straight onto the shelf."
                    : "The box is out of reach; the hook must pull it closer before it goes onto the shelf.";
  draft.seed = seed;
  draft.max_actions = within ? 2 : 5;
  draft.perturb_position = 0.01;
  draft.perturb_rotation = 0.0873;
  // The whole table about the arm: the end of the handle may be beside the base.
  draft.workspace_size = {1.6, 1.3, 1.0};
  draft.workspace_p_W = {0.3, 0, 0};
  draft.hand_radius = kHandRadius;

  DraftObject table;
  table.name = "table";
  table.shape = geometry::Shape(geometry::Box{{2.0, DrawLength(sizes, 1.1, 1.5), 0.5}});
  table.p_W = {0.5, 0, -0.25};
  table.colour = 0;
  table.remark = "its top is level with the robot's base";
  const DraftObject hook = DrawHook(random.Split("hook"));
  for (int attempt = 0; attempt < kDraws; ++attempt) {
    draft.objects = {table};
    if (PlaceAll(random.Split("attempt " + std::to_string(attempt)), within, hook, draft)) {
      return {draft.Write(), kDomain, WriteProblem(within)};
    }
  }
  assert(false);  // the table has room for these three
  return {};
}

}  // namespace tether::scenario
