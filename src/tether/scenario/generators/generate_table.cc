// Scenes of boxes on a bench: stack, sort, bin, clutter, crowd.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "tether/scenario/generators/generate_draft.h"

namespace tether::scenario {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kDraws = 1000;

/// A rectangle of the bench, m.
struct Area {
  double x_min, x_max, y_min, y_max;
};

DraftObject MakeBench() {
  DraftObject bench;
  bench.name = "bench";
  bench.shape = geometry::Shape(geometry::Box{{0.8, 1.2, 0.3}});
  bench.p_W = {0.58, 0, -0.15};
  bench.remark = "its top is level with the robot's base";
  return bench;
}

SceneDraft MakeDraft(const std::string& title, const std::string& arguments, uint64_t seed) {
  SceneDraft draft;
  draft.title = title + ", seed " + std::to_string(seed);
  draft.command = "tether generate " + arguments + " --seed " + std::to_string(seed);
  draft.seed = seed;
  draft.perturb_position = 0.01;
  draft.perturb_rotation = 0.0873;
  return draft;
}

/// Draws a place in the area until `accepts`. False if there seems to be none.
bool PlaceIn(const Area& area, Random& random, DraftObject& object, const std::function<bool()>& accepts) {
  for (int i = 0; i < kDraws; ++i) {
    object.p_W.x() = OnGrid(random.Uniform(area.x_min, area.x_max), 0.001);
    object.p_W.y() = OnGrid(random.Uniform(area.y_min, area.y_max), 0.001);
    object.yaw = OnGrid(random.Uniform(-kPi, kPi), 1e-4);
    if (accepts()) return true;
  }
  return false;
}

/// Boxes with sides from 3 cm to `largest`, spread over the area with `gap` between any two things. Tries
/// other places, with the same sizes, until all have one.
void SpreadBoxes(const Random& random, const std::vector<std::string>& names, double largest,
                 const Area& area, double gap, SceneDraft& draft) {
  const std::vector<DraftObject> before = draft.objects;
  for (int attempt = 0; attempt < kDraws; ++attempt) {
    draft.objects = before;
    Random sizes = random.Split("sizes"), places = random.Split("attempt " + std::to_string(attempt));
    bool complete = true;
    for (size_t i = 0; i < names.size() && complete; ++i) {
      DraftObject box = DrawBox(sizes, names[i], 0.03, largest);
      box.colour = 2 + static_cast<int>(i);
      complete = PlaceIn(area, places, box, [&] { return draft.IsClear(box, gap, {"bench"}); });
      draft.objects.push_back(box);
    }
    if (complete) return;
  }
  assert(false);  // the limits of the parameters see to it that there is room
}

Eigen::Vector3d BoxSize(const DraftObject& object) {
  return std::get<geometry::Box>(object.shape.parts.front().primitive).size;
}

/// In random order.
template <typename T>
void Shuffle(Random& random, std::vector<T>& values) {
  for (size_t i = values.size(); i > 1; --i) {
    std::swap(values[i - 1], values[random.Index(static_cast<int>(i))]);
  }
}

const char* const kStackDomain =
    R"(; One hand stacks blocks; only a block with nothing on it can be taken or built on.
(define (domain stack)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions)
  (:types
    support - object
    block - support)
  (:constants bench - support)
  (:predicates
    (inhand ?x - block)
    (on ?x - block ?y - support))

  (:action pick
    :parameters (?x - block)
    :precondition (forall (?y - block) (and (not (inhand ?y)) (not (on ?y ?x))))
    :effect (and
      (inhand ?x)
      (forall (?y - support) (not (on ?x ?y)))))

  (:action place
    :parameters (?x - block ?y - support)
    :precondition (and
      (inhand ?x)
      (not (= ?x ?y))
      (or (= ?y bench) (forall (?z - block) (not (on ?z ?y)))))
    :effect (and (on ?x ?y) (not (inhand ?x)))))
)";

const char* const kSortDomain = R"(; Each thing goes onto the tray of its kind.
(define (domain sort)
  (:requirements :strips :typing :negative-preconditions :universal-preconditions)
  (:types
    surface - object
    tray - surface
    thing - object)
  (:constants bench - surface)
  (:predicates
    (inhand ?x - thing)
    (on ?x - thing ?s - surface)
    (belongs ?x - thing ?t - tray))   ; the tray of its kind

  ; What is on the bench; what is sorted stays.
  (:action pick
    :parameters (?x - thing)
    :precondition (and (on ?x bench) (forall (?y - thing) (not (inhand ?y))))
    :effect (and (inhand ?x) (not (on ?x bench))))

  (:action place
    :parameters (?x - thing ?t - tray)
    :precondition (and (inhand ?x) (belongs ?x ?t))
    :effect (and (on ?x ?t) (not (inhand ?x)))))
)";

const char* const kClutterDomain = R"(; Take the target out of the clutter and put it on the mat.
(define (domain clutter)
  (:requirements :strips :typing :negative-preconditions)
  (:types
    surface - object
    thing - object)
  (:constants bench mat - surface)
  (:predicates
    (inhand ?x - thing)
    (on ?x - thing ?s - surface))

  (:action pick
    :parameters (?x - thing)
    :precondition (on ?x bench)
    :effect (and (inhand ?x) (not (on ?x bench))))

  (:action place
    :parameters (?x - thing ?s - surface)
    :precondition (inhand ?x)
    :effect (and (on ?x ?s) (not (inhand ?x)))))
)";

/// A cell of a tray holds one thing and the fingers beside it.
constexpr double kCell = 0.1;

/// Trays on both sides of the bench, each with room for `capacity` things.
void AddTrays(int trays, int capacity, SceneDraft& draft) {
  const int along = (capacity + 1) / 2;
  const Eigen::Vector3d size(kCell * along, capacity > 1 ? 2 * kCell : kCell, 0.02);
  const std::vector<std::string> names = Numbered("tray", trays);
  for (int i = 0; i < trays; ++i) {
    DraftObject tray;
    tray.name = names[i];
    tray.shape = geometry::Shape(geometry::Box{size});
    const bool two = trays > 2 && (trays == 4 || i % 2 == 0);  // on this side
    const double step = size.x() + 0.04;
    tray.p_W.x() = OnGrid(two ? 0.45 + (i / 2 == 0 ? -0.5 : 0.5) * step : 0.45, 0.001);
    tray.p_W.y() = OnGrid((i % 2 == 0 ? 1 : -1) * (0.28 + 0.5 * size.y()), 0.001);
    tray.p_W.z() = 0.5 * size.z();
    tray.colour = 2 + i;
    draft.objects.push_back(tray);
  }
}

/// A mat on one side, `nearest` to `furthest` from the middle (m), and a box on the other that is to go onto
/// it.
std::pair<DraftObject, DraftObject> DrawMatAndTarget(Random& things, double nearest, double furthest) {
  const double side = things.Index(2) == 0 ? 1 : -1;
  DraftObject mat;
  mat.name = "mat";
  mat.shape = geometry::Shape(geometry::Box{{0.12, 0.12, 0.01}});
  mat.p_W = {OnGrid(things.Uniform(0.40, 0.60), 0.001),
             OnGrid(side * things.Uniform(nearest, furthest), 0.001), 0.005};
  mat.colour = 1;
  DraftObject target = DrawBox(things, "target", 0.03, 0.06);
  target.colour = 2;
  target.p_W.x() = OnGrid(things.Uniform(0.45, 0.60), 0.001);
  target.p_W.y() = OnGrid(-side * things.Uniform(0.0, 0.15), 0.001);
  target.yaw = OnGrid(things.Uniform(-kPi, kPi), 1e-4);
  return {mat, target};
}

}  // namespace

GeneratedScenario GenerateStack(int blocks, uint64_t seed) {
  const Random random = Random(seed).Split("stack");
  SceneDraft draft =
      MakeDraft("Stack of " + std::to_string(blocks), "stack --blocks " + std::to_string(blocks), seed);
  draft.about =
      "The blocks are to be stacked in the order of their footprints, where the largest one stands.";
  draft.max_actions = 2 * (blocks - 1);
  DraftObject bench = MakeBench();
  draft.objects = {bench};
  const std::vector<std::string> names = Numbered("block", blocks);
  SpreadBoxes(random, names, 0.07, {0.32, 0.66, -0.35, 0.35}, 0.05, draft);

  // Broad below narrow, so that the tower stands; equal ones by number.
  std::vector<DraftObject> order(draft.objects.begin() + 1, draft.objects.end());
  std::stable_sort(order.begin(), order.end(), [](const DraftObject& a, const DraftObject& b) {
    return BoxSize(a).head<2>().minCoeff() > BoxSize(b).head<2>().minCoeff();
  });
  std::string init, goal;
  for (const std::string& name : names) init += " " + Fact("on", name, "bench");
  for (size_t i = 1; i < order.size(); ++i) goal += " " + Fact("on", order[i].name, order[i - 1].name);
  const std::string problem = "(define (problem stack)\n  (:domain stack)\n  (:objects " + Joined(names) +
                              " - block)\n  (:init" + init + ")\n  (:goal (and" + goal + ")))\n";
  return {draft.Write(), kStackDomain, problem};
}

GeneratedScenario GenerateSort(int objects, int regions, uint64_t seed) {
  const Random random = Random(seed).Split("sort");
  SceneDraft draft =
      MakeDraft("Sorting " + std::to_string(objects) + " things",
                "sort --objects " + std::to_string(objects) + " --regions " + std::to_string(regions), seed);
  draft.about =
      "Each thing goes onto the tray of its kind (its colour). Any order will do, so the first plan is "
      "taken.";
  draft.max_actions = 2 * objects;
  draft.max_plans = 1;
  draft.objects = {MakeBench()};
  AddTrays(regions, (objects + regions - 1) / regions, draft);
  const std::vector<std::string> names = Numbered("thing", objects);
  SpreadBoxes(random, names, 0.05, {0.30, 0.68, -0.20, 0.20}, 0.04, draft);

  // As many of each kind as can be, dealt out in random order.
  std::vector<int> kinds;
  for (int i = 0; i < objects; ++i) kinds.push_back(i % regions);
  Random deal = random.Split("kinds");
  Shuffle(deal, kinds);
  const std::vector<std::string> trays = Numbered("tray", regions);
  std::string init, goal;
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string& tray = trays[kinds[i]];
    draft.objects[1 + trays.size() + i].colour = 2 + kinds[i];
    init += "\n    " + Fact("on", names[i], "bench") + " " + Fact("belongs", names[i], tray);
    goal += " " + Fact("on", names[i], tray);
  }
  const std::string problem = "(define (problem sort)\n  (:domain sort)\n  (:objects\n    " + Joined(names) +
                              " - thing\n    " + Joined(trays) + " - tray)\n  (:init" + init +
                              ")\n  (:goal (and" + goal + ")))\n";
  return {draft.Write(), kSortDomain, problem};
}

GeneratedScenario GenerateBin(int objects, uint64_t seed) {
  const Random random = Random(seed).Split("bin");
  SceneDraft draft =
      MakeDraft("A bin for " + std::to_string(objects), "bin --objects " + std::to_string(objects), seed);
  draft.about = "All cubes go into the bin, in any order: the first plan is taken.";
  draft.max_actions = 2 * objects;
  draft.max_plans = 1;
  Random sizes = random.Split("bin's size");
  const double inside = DrawLength(sizes, 0.23, 0.26), height = DrawLength(sizes, 0.06, 0.08);
  const double side = sizes.Index(2) == 0 ? 1 : -1;
  constexpr double kFloor = 0.01, kWall = 0.01;
  const auto wall = [&](const Eigen::Vector3d& size, const Eigen::Vector3d& p) {
    return geometry::Part{geometry::Box{size}, math::Pose(p)};
  };
  const double outside = inside + 2 * kWall, middle = 0.5 * (inside + kWall);
  const double level = kFloor + 0.5 * height;
  DraftObject bin;
  bin.name = "bin";
  bin.shape = geometry::Shape(std::vector<geometry::Part>{
      wall({outside, outside, kFloor}, {0, 0, 0.5 * kFloor}),
      wall({outside, kWall, height}, {0, middle, level}), wall({outside, kWall, height}, {0, -middle, level}),
      wall({kWall, inside, height}, {middle, 0, level}), wall({kWall, inside, height}, {-middle, 0, level})});
  bin.p_W = {DrawLength(sizes, 0.42, 0.48), OnGrid(side * DrawLength(sizes, 0.27, 0.31), 0.001), 0};
  bin.colour = 1;
  draft.objects = {MakeBench(), bin};
  const std::vector<std::string> names = Numbered("cube", objects);
  const std::vector<DraftObject> before = draft.objects;
  Random cubes = random.Split("cubes");
  std::vector<DraftObject> drawn;
  for (const std::string& name : names) {
    DraftObject cube = DrawBox(cubes, name, 0.042, 0.048);
    cube.colour = 2 + static_cast<int>(drawn.size());
    drawn.push_back(cube);
  }
  const Area area{0.32, 0.64, side > 0 ? -0.35 : -0.06, side > 0 ? 0.06 : 0.35};
  for (int attempt = 0; attempt < kDraws; ++attempt) {
    draft.objects = before;
    Random places = random.Split("attempt " + std::to_string(attempt));
    bool complete = true;
    for (DraftObject cube : drawn) {
      complete =
          complete && PlaceIn(area, places, cube, [&] { return draft.IsClear(cube, 0.04, {"bench"}); });
      draft.objects.push_back(cube);
    }
    if (complete) break;
    assert(attempt + 1 < kDraws);
  }
  std::string init, goal;
  for (const std::string& name : names) {
    init += "\n    " + Fact("on", name, "bench") + " " + Fact("belongs", name, "bin");
    goal += " " + Fact("on", name, "bin");
  }
  const std::string problem = "(define (problem bin)\n  (:domain sort)\n  (:objects\n    " + Joined(names) +
                              " - thing\n    bin - tray)\n  (:init" + init + ")\n  (:goal (and" + goal +
                              ")))\n";
  return {draft.Write(), kSortDomain, problem};
}

GeneratedScenario GenerateCrowd(int objects, uint64_t seed) {
  const Random random = Random(seed).Split("crowd");
  SceneDraft draft =
      MakeDraft("A crowd of " + std::to_string(objects), "crowd --objects " + std::to_string(objects), seed);
  draft.about = "The target goes onto the mat; what stands around is far enough away to be no matter.";
  draft.max_actions = 2;
  DraftObject floor = MakeBench();
  floor.shape = geometry::Shape(geometry::Box{{2.4, 2.8, 0.3}});
  Random things = random.Split("target");
  const auto [mat, target] = DrawMatAndTarget(things, 0.25, 0.35);
  draft.objects = {floor, mat, target};

  // There is room for the hand about the target and the mat, and for the arm about its base.
  SceneDraft kept_free;
  for (const Eigen::Vector3d& p : {target.p_W, mat.p_W, Eigen::Vector3d(0, 0, 0)}) {
    DraftObject round;
    round.shape = geometry::Shape(geometry::Cylinder{0.18, 0.4});
    round.p_W = p;
    kept_free.objects.push_back(round);
  }
  Random sizes = random.Split("sizes"), places = random.Split("places");
  for (const std::string& name : Numbered("other", objects)) {
    DraftObject other = DrawBox(sizes, name, 0.03, 0.07);
    other.colour = 5 + static_cast<int>(draft.objects.size()) % 5;
    const bool placed = PlaceIn({-0.5, 1.6, -1.2, 1.2}, places, other, [&] {
      return draft.IsClear(other, 0.01, {"bench"}) && kept_free.IsClear(other, 0, {});
    });
    if (placed) draft.objects.push_back(other);
  }
  const std::string problem =
      "; What stands around is no part of the task: nothing may touch it.\n(define (problem crowd)\n"
      "  (:domain clutter)\n  (:objects target - thing)\n  (:init (on target bench))\n"
      "  (:goal (on target mat)))\n";
  return {draft.Write(), kClutterDomain, problem};
}

GeneratedScenario GenerateClutter(int objects, uint64_t seed) {
  const Random random = Random(seed).Split("clutter");
  SceneDraft draft = MakeDraft("Clutter of " + std::to_string(objects),
                               "clutter --objects " + std::to_string(objects), seed);
  draft.about = "The target stands among obstacles; it goes onto the mat.";
  draft.max_actions = 2;
  Random things = random.Split("target");
  const auto [mat, target] = DrawMatAndTarget(things, 0.30, 0.40);

  // There is room for the open hand about the target along one of its sides, and about the mat in any
  // orientation.
  DraftObject hand = target;
  const bool along_x = things.Index(2) == 0;
  hand.shape = geometry::Shape(along_x ? geometry::Box{{0.23, 0.09, 0.2}} : geometry::Box{{0.09, 0.23, 0.2}});
  DraftObject turning = mat;
  turning.shape = geometry::Shape(geometry::Cylinder{0.12, 0.2});
  SceneDraft kept_free;
  kept_free.objects = {hand, turning};

  const std::vector<std::string> names = Numbered("obstacle", objects);
  const Area around{target.p_W.x() - 0.2, target.p_W.x() + 0.2, target.p_W.y() - 0.2, target.p_W.y() + 0.2};
  Random sizes = random.Split("sizes");
  std::vector<DraftObject> obstacles;
  for (int i = 0; i < objects; ++i) {
    DraftObject obstacle = DrawBox(sizes, names[i], 0.03, 0.07);
    if (sizes.Uniform(0, 1) < 0.3) {
      const Eigen::Vector3d size = BoxSize(obstacle);
      const geometry::Cylinder can{OnGrid(0.5 * size.x(), 1e-4), size.z()};
      obstacle.shape = geometry::Shape(can);
      obstacle.mass = WoodenMass(geometry::Volume(can));
    }
    obstacle.colour = 5 + i % 5;
    obstacles.push_back(obstacle);
  }
  for (int attempt = 0; attempt < kDraws; ++attempt) {
    draft.objects = {MakeBench(), mat, target};
    Random places = random.Split("attempt " + std::to_string(attempt));
    bool complete = true;
    for (DraftObject obstacle : obstacles) {
      complete = complete && PlaceIn(around, places, obstacle, [&] {
                   return draft.IsClear(obstacle, 0.01, {"bench"}) && kept_free.IsClear(obstacle, 0, {});
                 });
      draft.objects.push_back(obstacle);
    }
    if (complete) break;
    assert(attempt + 1 < kDraws);
  }
  const std::string problem =
      "; The obstacles are no part of the task: nothing may touch them.\n(define (problem clutter)\n"
      "  (:domain clutter)\n  (:objects target - thing)\n  (:init (on target bench))\n"
      "  (:goal (on target mat)))\n";
  return {draft.Write(), kClutterDomain, problem};
}

}  // namespace tether::scenario
