#include <array>

#include "tether/scenario/generators/generate_draft.h"

namespace tether::scenario {
namespace {

constexpr double kLargest = 0.07, kSmallest = 0.03;  // edges, m: what the gripper can grasp
constexpr double kPlate = 0.17, kPlateHeight = 0.07;
constexpr double kPlateDistance = 0.2;
const std::array<const char*, 3> kPlates = {"platform_left", "platform_middle", "platform_right"};

const char* const kDomain = R"(; The tower of Hanoi with three plates.
(define (domain hanoi)
  (:requirements :strips :typing :equality :negative-preconditions :universal-preconditions :conditional-effects)
  (:types
    physobj - object
    movable - physobj)
  (:constants platform_left platform_middle platform_right - physobj)
  (:predicates
    (inhand ?a - movable)                 ; the hand holds a
    (on ?a - movable ?b - physobj)        ; a rests on b
    (smaller ?a - physobj ?b - physobj))  ; a may rest on b

  (:action pick
    :parameters (?a - movable)
    :precondition (forall (?b - movable) (and (not (inhand ?b)) (not (on ?b ?a))))
    :effect (and
      (inhand ?a)
      (forall (?b - physobj) (not (on ?a ?b)))))

  (:action place
    :parameters (?a - movable ?b - physobj)
    :precondition (and
      (inhand ?a)
      (smaller ?a ?b)
      (forall (?c - movable) (not (on ?c ?b))))
    :effect (and
      (not (inhand ?a))
      (on ?a ?b))))
)";

/// Edges from the smallest to the largest: evenly spaced, those between moved by up to a fifth of the
/// spacing.
std::vector<double> DrawEdges(Random random, int blocks) {
  const double spacing = (kLargest - kSmallest) / (blocks - 1);
  std::vector<double> edges;
  for (int i = 0; i < blocks; ++i) {
    const double move = random.Uniform(-0.2, 0.2);
    const bool end = i == 0 || i == blocks - 1;
    edges.push_back(OnGrid(kSmallest + spacing * (i + (end ? 0 : move)), 1e-4));
  }
  return edges;
}

std::string Tower(const std::vector<std::string>& names, const std::string& plate) {
  std::string facts;
  for (size_t i = 0; i < names.size(); ++i) {
    facts += " " + Fact("on", names[i], i + 1 < names.size() ? names[i + 1] : plate);
  }
  return facts.substr(1);
}

std::string WriteProblem(const std::vector<std::string>& names, size_t start) {
  std::string text = "; Move the tower from " + std::string(kPlates[start]) +
                     " to one of the others. block_1 is the smallest.\n(define (problem tower-of-hanoi)\n"
                     "  (:domain hanoi)\n  (:objects " +
                     Joined(names) + " - movable)\n  (:init\n";
  for (size_t i = 0; i < names.size(); ++i) {
    text += "   ";
    for (const char* plate : kPlates) text += " " + Fact("smaller", names[i], plate);
    for (size_t j = i + 1; j < names.size(); ++j) text += " " + Fact("smaller", names[i], names[j]);
    text += "\n";
  }
  text += "    " + Tower(names, kPlates[start]) + ")\n  (:goal (or";
  for (size_t i = 0; i < kPlates.size(); ++i) {
    if (i != start) text += "\n    (and " + Tower(names, kPlates[i]) + ")";
  }
  return text + ")))\n";
}

}  // namespace

GeneratedScenario GenerateHanoi(int blocks, uint64_t seed) {
  const Random random = Random(seed).Split("hanoi");
  Random places = random.Split("places");
  SceneDraft draft;
  draft.title = "Tower of Hanoi, " + std::to_string(blocks) + " blocks, seed " + std::to_string(seed);
  draft.command =
      "tether generate hanoi --blocks " + std::to_string(blocks) + " --seed " + std::to_string(seed);
  draft.about = "The tower goes to one of the other plates, never a larger block on a smaller one.";
  draft.seed = seed;
  draft.max_actions = 2 * ((1 << blocks) - 1);
  draft.perturb_position = 0.002;
  draft.perturb_rotation = 0.02;

  const double x = OnGrid(places.Uniform(0.55, 0.65), 0.001);
  const auto start = static_cast<size_t>(places.Index(3));
  for (size_t i = 0; i < kPlates.size(); ++i) {
    DraftObject plate;
    plate.name = kPlates[i];
    plate.shape = geometry::Shape(geometry::Box{{kPlate, kPlate, kPlateHeight}});
    plate.p_W = {x, kPlateDistance * (1 - static_cast<double>(i)), -0.5 * kPlateHeight};
    plate.colour = 1;
    draft.objects.push_back(plate);
  }
  const std::vector<double> edges = DrawEdges(random.Split("edges"), blocks);
  const std::vector<std::string> names = Numbered("block", blocks);
  double z = 0;  // the plates' upper faces
  for (size_t i = edges.size(); i-- > 0;) {
    DraftObject block;
    block.name = names[i];
    block.shape = geometry::Shape(geometry::Box{Eigen::Vector3d::Constant(edges[i])});
    block.p_W = {x, draft.objects[start].p_W.y(), z + 0.5 * edges[i]};
    block.mass = WoodenMass(edges[i] * edges[i] * edges[i]);
    block.colour = 2 + static_cast<int>(i);
    z += edges[i];
    draft.objects.push_back(block);
  }
  return {draft.Write(), kDomain, WriteProblem(names, start)};
}

}  // namespace tether::scenario
