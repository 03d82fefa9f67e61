// Scenes that ask for the motion of the whole arm: around, posts, shelf.

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "tether/geometry/distance/distance.h"
#include "tether/motion/start_check.h"
#include "tether/scenario/generators/generate_draft.h"

namespace tether::scenario {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kDraws = 1000;

const char* const kDomain = R"(; Things are carried to where they may be put; what is put down stays.
(define (domain carry)
  (:requirements :strips :typing :negative-preconditions :universal-preconditions)
  (:types
    surface - object
    thing - object)
  (:predicates
    (inhand ?x - thing)
    (on ?x - thing ?s - surface)
    (placed ?x - thing)
    (before ?x ?y - thing)            ; x is in the way to y
    (open ?s - surface))              ; things may be put there

  (:action pick
    :parameters (?x - thing)
    :precondition (and
      (not (placed ?x))
      (forall (?y - thing) (and (not (inhand ?y)) (or (placed ?y) (not (before ?y ?x))))))
    :effect (and (inhand ?x) (forall (?s - surface) (not (on ?x ?s)))))

  (:action place
    :parameters (?x - thing ?s - surface)
    :precondition (and (inhand ?x) (open ?s))
    :effect (and (on ?x ?s) (placed ?x) (not (inhand ?x)))))
)";

std::string WriteProblem(const std::string& surfaces, const std::vector<std::string>& things,
                         const std::string& init, const std::string& goal) {
  return "(define (problem carry)\n  (:domain carry)\n  (:objects " + surfaces + " - surface\n    " +
         Joined(things) + " - thing)\n  (:init" + init + ")\n  (:goal (and" + goal + ")))\n";
}

SceneDraft MakeDraft(const std::string& title, const std::string& arguments, uint64_t seed) {
  SceneDraft draft;
  draft.title = title + ", seed " + std::to_string(seed);
  draft.command = "tether generate " + arguments + " --seed " + std::to_string(seed);
  draft.seed = seed;
  draft.max_plans = draft.min_candidates = 1;
  draft.perturb_position = 0.005;
  draft.perturb_rotation = 0.05;
  return draft;
}

DraftObject MakeFixed(const std::string& name, const Eigen::Vector3d& size, const Eigen::Vector3d& p_W,
                      int colour, const std::string& remark = "") {
  DraftObject object;
  object.name = name;
  object.shape = geometry::Shape(geometry::Box{size});
  object.p_W = p_W;
  object.colour = colour;
  object.remark = remark;
  return object;
}

DraftObject MakeBench() {
  return MakeFixed("bench", {0.8, 1.2, 0.3}, {0.58, 0, -0.15}, 0, "its top is level with the robot's base");
}

// --- around

// How far from the base's axis the middle of a stand is, and how large it is along and across that line, m.
constexpr double kStandRadius = 0.52, kStandDepth = 0.3, kStandWidth = 0.44;
// The arm turns no further than this from straight ahead, rad.
constexpr double kMostBearing = 2.6;

DraftObject MakeStand(const std::string& name, double bearing, double top, int colour) {
  constexpr double kHeight = 0.3;
  DraftObject stand = MakeFixed(name, {kStandDepth, kStandWidth, kHeight}, {}, colour);
  stand.p_W = {OnGrid(kStandRadius * std::cos(bearing), 0.001),
               OnGrid(kStandRadius * std::sin(bearing), 0.001), top - 0.5 * kHeight};
  stand.yaw = bearing;
  return stand;
}

double DrawTop(Random& random) { return DrawLength(random, -0.05, 0.12); }

// --- posts

// Room that posts leave about what is carried, where it goes, the base's axis, and the arm at its start, m.
constexpr double kAboutThings = 0.13, kAboutBase = 0.2, kAboutArm = 0.05;

/// The arm as it stands at the start, at the origin.
std::vector<motion::Obstacle> ArmAtStart() {
  static const auto model = robot::Model::Load("panda");
  std::vector<motion::Obstacle> arm;
  motion::AddArm("panda", *model, model->home(), {}, &arm);
  return arm;
}

DraftObject DrawPost(Random& random, const std::string& name) {
  DraftObject post;
  post.name = name;
  const double radius = DrawLength(random, 0.008, 0.015), height = DrawLength(random, 0.15, 0.6);
  if (random.Index(2) == 0) {
    post.shape = geometry::Shape(geometry::Cylinder{radius, height});
  } else {
    post.shape = geometry::Shape(geometry::Box{{2 * radius, 2 * radius, height}});
  }
  post.p_W.z() = 0.5 * height;
  post.colour = 9;
  return post;
}

// --- shelf

constexpr double kBoard = 0.015;         // Of walls, roof and back, m.
constexpr double kRow = 0.09;            // From a thing to the one behind it, m …
constexpr double kFirstRow = 0.05;       // … and from the front edge to the first, m.
constexpr int kRows = 3;                 // Things behind each other.
constexpr double kBesideThings = 0.115;  // From the middle of a thing to a wall, m.

DraftObject DrawThing(Random& random, const std::string& name) {
  DraftObject thing;
  thing.name = name;
  const double height = DrawLength(random, 0.10, 0.16);
  if (random.Index(2) == 0) {
    thing.shape = geometry::Shape(geometry::Cylinder{DrawLength(random, 0.02, 0.03), height});
  } else {
    thing.shape = geometry::Shape(
        geometry::Box{{DrawLength(random, 0.04, 0.055), DrawLength(random, 0.04, 0.055), height}});
    thing.yaw = OnGrid(random.Uniform(-0.3, 0.3), 1e-4);
  }
  thing.mass = WoodenMass(geometry::Volume(thing.shape.parts.front().primitive));
  thing.p_W.z() = 0.5 * height;
  return thing;
}

}  // namespace

GeneratedScenario GenerateAround(int blocks, uint64_t seed) {
  const Random random = Random(seed).Split("around");
  SceneDraft draft = MakeDraft("Around", "around --blocks " + std::to_string(blocks), seed);
  draft.about = "Blocks are carried from one side of the arm to the other. Any order will do.";
  draft.max_actions = 2 * blocks;
  draft.workspace_size = {2, 2, 1.6};
  draft.workspace_p_W = {0, 0, 0.3};
  Random stands = random.Split("stands");
  double here = 0, there = 0;
  do {
    here = OnGrid(stands.Uniform(-kMostBearing, kMostBearing), 1e-4);
    there = OnGrid(std::remainder(here + kPi + stands.Uniform(-0.9, 0.9), 2 * kPi), 1e-4);
  } while (std::abs(there) > kMostBearing);
  draft.objects = {MakeStand("here", here, DrawTop(stands), 0),
                   MakeStand("there", there, DrawTop(stands), 1)};
  const DraftObject stand = draft.objects.front();
  const double top = stand.p_W.z() + 0.15;
  const std::vector<std::string> names = Numbered("block", blocks);
  const std::vector<DraftObject> before = draft.objects;
  for (int attempt = 0; attempt < kDraws; ++attempt) {
    assert(attempt + 1 < kDraws);
    draft.objects = before;
    Random sizes = random.Split("sizes"), places = random.Split("attempt " + std::to_string(attempt));
    bool complete = true;
    for (size_t i = 0; i < names.size() && complete; ++i) {
      DraftObject block = DrawBox(sizes, names[i], 0.03, 0.055);
      block.colour = 2 + static_cast<int>(i);
      const Eigen::Vector3d at =
          stand.X_WO() * Eigen::Vector3d(places.Uniform(-0.1, 0.1), places.Uniform(-0.17, 0.17), 0);
      block.p_W = {OnGrid(at.x(), 0.001), OnGrid(at.y(), 0.001), top + block.p_W.z()};
      block.yaw = OnGrid(places.Uniform(-kPi, kPi), 1e-4);
      complete = draft.IsClear(block, 0.045, {"here"});
      draft.objects.push_back(block);
    }
    if (complete) break;
  }
  std::string init = " (open there)", goal;
  for (const std::string& name : names) {
    init += " " + Fact("on", name, "here");
    goal += " " + Fact("on", name, "there");
  }
  return {draft.Write(), kDomain, WriteProblem("here there", names, init, goal)};
}

GeneratedScenario GeneratePosts(int objects, uint64_t seed) {
  const Random random = Random(seed).Split("posts");
  SceneDraft draft = MakeDraft("Posts", "posts --objects " + std::to_string(objects), seed);
  draft.about = "The target goes onto the mat; thin posts stand beside the arm.";
  draft.max_actions = 2;
  Random things = random.Split("target");
  const double side = things.Index(2) == 0 ? 1 : -1;
  DraftObject mat = MakeFixed("mat", {0.12, 0.12, 0.01}, {}, 1);
  mat.p_W = {DrawLength(things, 0.38, 0.60), side * DrawLength(things, 0.22, 0.42), 0.005};
  DraftObject target = DrawBox(things, "target", 0.03, 0.06);
  target.colour = 2;
  target.p_W.x() = DrawLength(things, 0.38, 0.62);
  target.p_W.y() = -side * DrawLength(things, 0.05, 0.4);
  target.yaw = OnGrid(things.Uniform(-kPi, kPi), 1e-4);
  draft.objects = {MakeBench(), mat, target};

  SceneDraft kept_free;
  for (const Eigen::Vector3d& p : {target.p_W, mat.p_W, Eigen::Vector3d(0, 0, 0)}) {
    DraftObject round;
    round.shape = geometry::Shape(geometry::Cylinder{p.isZero() ? kAboutBase : kAboutThings, 0.8});
    round.p_W = {p.x(), p.y(), 0.4};
    kept_free.objects.push_back(round);
  }
  const std::vector<motion::Obstacle> arm = ArmAtStart();
  Random posts = random.Split("posts");
  for (const std::string& name : Numbered("post", objects)) {
    DraftObject post = DrawPost(posts, name);
    for (int draw = 0; draw < kDraws; ++draw) {
      post.p_W.x() = OnGrid(posts.Uniform(0.22, 0.8), 0.001);
      post.p_W.y() = OnGrid(posts.Uniform(-0.55, 0.55), 0.001);
      const bool clear = std::all_of(arm.begin(), arm.end(), [&](const motion::Obstacle& link) {
        return geometry::SignedDistance(post.shape, post.X_WO(), link.shape, link.X_BO).distance > kAboutArm;
      });
      if (!clear || !draft.IsClear(post, 0.03, {"bench"}) || !kept_free.IsClear(post, 0, {})) continue;
      draft.objects.push_back(post);
      break;
    }
  }
  return {draft.Write(), kDomain,
          WriteProblem("bench mat", {"target"}, " (on target bench) (open mat)", " (on target mat)")};
}

GeneratedScenario GenerateShelf(int objects, int compartments, uint64_t seed) {
  const Random random = Random(seed).Split("shelf");
  SceneDraft draft = MakeDraft(
      "Shelf", "shelf --objects " + std::to_string(objects) + " --regions " + std::to_string(compartments),
      seed);
  draft.about =
      "The target comes out of its compartment onto the tray; what stands before it goes onto the counter.";
  draft.actions = "shelves";
  draft.workspace_size = {1.1, 1.3, 1.2};
  draft.workspace_p_W = {0.55, 0, 0.5};
  Random sizes = random.Split("sizes"), places = random.Split("places");
  const double depth = DrawLength(sizes, 0.28, 0.32), room = DrawLength(sizes, 0.26, 0.34);
  const double width = DrawLength(sizes, 0.28, 0.34), level = DrawLength(sizes, 0.03, 0.22);
  const double front = DrawLength(places, 0.46, 0.52), middle = DrawLength(places, -0.05, 0.05);
  const double across = compartments * width + (compartments + 1) * kBoard;
  const double x = front + 0.5 * depth, inside = level + 0.5 * room;
  draft.objects = {
      MakeBench(), MakeFixed("board", {depth, across, level}, {x, middle, 0.5 * level}, 9),
      MakeFixed("roof", {depth, across, kBoard}, {x, middle, level + room + 0.5 * kBoard}, 9),
      MakeFixed("back", {kBoard, across, room}, {front + depth - 0.5 * kBoard, middle, inside}, 9)};
  const double left = middle - 0.5 * across;
  for (int i = 0; i <= compartments; ++i) {
    draft.objects.push_back(MakeFixed("wall_" + std::to_string(i + 1), {depth - kBoard, kBoard, room},
                                      {x - 0.5 * kBoard, left + 0.5 * kBoard + i * (width + kBoard), inside},
                                      9));
  }
  // Beside the shelf, each on its side.
  const double side = places.Index(2) == 0 ? 1 : -1, low = DrawLength(sizes, 0.02, 0.1);
  draft.objects.push_back(MakeFixed("tray", {0.2, 0.2, low}, {0.32, side * 0.42, 0.5 * low}, 1));
  draft.objects.push_back(MakeFixed("counter", {0.22, 0.3, low}, {0.31, -side * 0.44, 0.5 * low}, 1));

  // What stands where: the target behind up to two others, the rest in the other compartments.
  const int mine = places.Index(compartments);
  std::vector<int> filled(static_cast<size_t>(compartments), 0);
  const int before = places.Index(std::min(kRows, objects));
  std::vector<std::string> names = Numbered("thing", objects - 1);
  names.insert(names.begin() + before, "target");
  std::string init = " (open tray) (open counter)";
  std::vector<std::vector<std::string>> standing(static_cast<size_t>(compartments));
  for (int i = 0; i < objects; ++i) {
    int at = mine;
    if (i > before) {
      // Behind the target there is nothing.
      filled[static_cast<size_t>(mine)] = kRows;
      const auto emptiest = std::min_element(filled.begin(), filled.end());
      if (*emptiest == kRows) break;
      at = static_cast<int>(emptiest - filled.begin());
    }
    DraftObject thing = DrawThing(sizes, names[static_cast<size_t>(i)]);
    const double aside = std::max(0.0, 0.5 * width - kBesideThings);
    thing.p_W.x() = OnGrid(front + kFirstRow + kRow * filled[static_cast<size_t>(at)], 0.001);
    thing.p_W.y() =
        OnGrid(left + kBoard + 0.5 * width + at * (width + kBoard) + places.Uniform(-aside, aside), 0.001);
    thing.p_W.z() += level;
    thing.colour = thing.name == "target" ? 2 : 5 + i % 4;
    ++filled[static_cast<size_t>(at)];
    init += "\n    " + Fact("on", thing.name, "board");
    for (const std::string& other : standing[static_cast<size_t>(at)])
      init += " " + Fact("before", other, thing.name);
    standing[static_cast<size_t>(at)].push_back(thing.name);
    draft.objects.push_back(thing);
  }
  draft.max_actions = 2 * (before + 1);
  std::vector<std::string> things;
  for (const DraftObject& object : draft.objects) {
    if (object.mass > 0) things.push_back(object.name);
  }
  return {draft.Write(), kDomain, WriteProblem("board tray counter", things, init, " (on target tray)")};
}

}  // namespace tether::scenario
