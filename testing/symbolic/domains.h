#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tether/symbolic/pddl/pddl.h"

/// For tests and benchmarks: domains of the International Planning Competition of 2000 and 2002 in our words,
/// and instances of them. The goals of the published instances are quoted as facts; their optima are known.
namespace tether::symbolic::domains {

inline std::shared_ptr<const Problem> Parse(const std::string& domain, const std::string& problem) {
  return ParseProblem(problem, "problem", ParseDomain(domain, "domain"));
}

/// Towers of blocks named by single letters, each from bottom to top.
inline std::string BlocksDomain() {
  return R"((define (domain blocks)
  (:requirements :strips)
  (:predicates (on ?x ?y) (ontable ?x) (clear ?x) (handempty) (holding ?x))
  (:action pick-up :parameters (?x) :precondition (and (clear ?x) (ontable ?x) (handempty))
    :effect (and (not (ontable ?x)) (not (clear ?x)) (not (handempty)) (holding ?x)))
  (:action put-down :parameters (?x) :precondition (holding ?x)
    :effect (and (not (holding ?x)) (clear ?x) (handempty) (ontable ?x)))
  (:action stack :parameters (?x ?y) :precondition (and (holding ?x) (clear ?y))
    :effect (and (not (holding ?x)) (not (clear ?y)) (clear ?x) (handempty) (on ?x ?y)))
  (:action unstack :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x) (handempty))
    :effect (and (holding ?x) (clear ?y) (not (clear ?x)) (not (handempty)) (not (on ?x ?y)))))
)";
}

inline std::string BlocksProblem(const std::vector<std::string>& init, const std::vector<std::string>& goal) {
  auto name = [](char c) { return std::string(1, c); };
  std::string objects, facts, aims;
  for (const std::string& tower : init) {
    facts += " (ontable " + name(tower.front()) + ") (clear " + name(tower.back()) + ")";
    for (char block : tower) objects += " " + name(block);
    for (size_t i = 1; i < tower.size(); ++i)
      facts += " (on " + name(tower[i]) + " " + name(tower[i - 1]) + ")";
  }
  for (const std::string& tower : goal) {
    for (size_t i = 1; i < tower.size(); ++i)
      aims += " (on " + name(tower[i]) + " " + name(tower[i - 1]) + ")";
  }
  return "(define (problem blocks) (:domain blocks) (:objects" + objects + ")\n(:init (handempty)" + facts +
         ")\n(:goal (and" + aims + ")))\n";
}

inline std::shared_ptr<const Problem> Blocks(const std::vector<std::string>& init,
                                             const std::vector<std::string>& goal) {
  return Parse(BlocksDomain(), BlocksProblem(init, goal));
}
/// Instances 4-0, 8-0 and 10-0 of the competition: 6, 18 and 34 actions.
inline std::shared_ptr<const Problem> Blocks4() { return Blocks({"A", "B", "C", "D"}, {"ABCD"}); }
inline std::shared_ptr<const Problem> Blocks8() { return Blocks({"EGA", "FHD", "B", "C"}, {"BGACHEFD"}); }
inline std::shared_ptr<const Problem> Blocks10() { return Blocks({"IDAHGBJEC", "F"}, {"IGABHEJFCD"}); }

/// Two rooms, two grippers, all balls in one room and wanted in the other: 3n − 1 actions for an even number.
inline std::shared_ptr<const Problem> Gripper(int balls) {
  const std::string domain = R"((define (domain gripper-strips)
  (:predicates (room ?r) (ball ?b) (gripper ?g) (at-robby ?r) (at ?b ?r) (free ?g) (carry ?o ?g))
  (:action move :parameters (?from ?to) :precondition (and (room ?from) (room ?to) (at-robby ?from))
    :effect (and (at-robby ?to) (not (at-robby ?from))))
  (:action pick :parameters (?obj ?room ?gripper)
    :precondition (and (ball ?obj) (room ?room) (gripper ?gripper) (at ?obj ?room) (at-robby ?room) (free ?gripper))
    :effect (and (carry ?obj ?gripper) (not (at ?obj ?room)) (not (free ?gripper))))
  (:action drop :parameters (?obj ?room ?gripper)
    :precondition (and (ball ?obj) (room ?room) (gripper ?gripper) (carry ?obj ?gripper) (at-robby ?room))
    :effect (and (at ?obj ?room) (free ?gripper) (not (carry ?obj ?gripper)))))
)";
  std::string objects, init, goal;
  for (int i = 1; i <= balls; ++i) {
    const std::string ball = "ball" + std::to_string(i);
    objects += " " + ball;
    init += " (ball " + ball + ") (at " + ball + " rooma)";
    goal += " (at " + ball + " roomb)";
  }
  return Parse(domain, "(define (problem gripper) (:domain gripper-strips) (:objects rooma roomb left right" +
                           objects +
                           ")\n(:init (room rooma) (room roomb) (gripper left) (gripper right) (free left) "
                           "(free right) (at-robby rooma)" +
                           init + ")\n(:goal (and" + goal + ")))\n");
}

/// Packages obj<city><1…3> at each city's pos, a truck there, airports apt, one airplane.
inline std::shared_ptr<const Problem> Logistics(
    int cities, const std::string& plane_at, const std::vector<std::pair<std::string, std::string>>& goals) {
  const std::string domain = R"((define (domain logistics)
  (:predicates (obj ?o) (truck ?t) (location ?l) (airplane ?a) (city ?c) (airport ?l)
    (at ?o ?l) (in ?o ?v) (in-city ?l ?c))
  (:action load-truck :parameters (?obj ?truck ?loc)
    :precondition (and (obj ?obj) (truck ?truck) (location ?loc) (at ?truck ?loc) (at ?obj ?loc))
    :effect (and (not (at ?obj ?loc)) (in ?obj ?truck)))
  (:action load-airplane :parameters (?obj ?plane ?loc)
    :precondition (and (obj ?obj) (airplane ?plane) (location ?loc) (at ?obj ?loc) (at ?plane ?loc))
    :effect (and (not (at ?obj ?loc)) (in ?obj ?plane)))
  (:action unload-truck :parameters (?obj ?truck ?loc)
    :precondition (and (obj ?obj) (truck ?truck) (location ?loc) (at ?truck ?loc) (in ?obj ?truck))
    :effect (and (not (in ?obj ?truck)) (at ?obj ?loc)))
  (:action unload-airplane :parameters (?obj ?plane ?loc)
    :precondition (and (obj ?obj) (airplane ?plane) (location ?loc) (in ?obj ?plane) (at ?plane ?loc))
    :effect (and (not (in ?obj ?plane)) (at ?obj ?loc)))
  (:action drive-truck :parameters (?truck ?from ?to ?city)
    :precondition (and (truck ?truck) (location ?from) (location ?to) (city ?city) (at ?truck ?from)
      (in-city ?from ?city) (in-city ?to ?city))
    :effect (and (not (at ?truck ?from)) (at ?truck ?to)))
  (:action fly-airplane :parameters (?plane ?from ?to)
    :precondition (and (airplane ?plane) (airport ?from) (airport ?to) (at ?plane ?from))
    :effect (and (not (at ?plane ?from)) (at ?plane ?to))))
)";
  std::string objects = " apn1", init = " (airplane apn1) (at apn1 " + plane_at + ")", goal;
  for (int city = 1; city <= cities; ++city) {
    const std::string n = std::to_string(city);
    objects += " cit" + n + " pos" + n + " apt" + n + " tru" + n;
    init += " (city cit" + n + ") (truck tru" + n + ") (at tru" + n + " pos" + n + ") (airport apt" + n + ")";
    for (const std::string place : {"pos", "apt"}) {
      init += " (location " + place + n + ") (in-city " + place + n + " cit" + n + ")";
    }
    for (int k = 1; k <= 3; ++k) {
      const std::string object = "obj" + n + std::to_string(k);
      objects += " " + object;
      init += " (obj " + object + ") (at " + object + " pos" + n + ")";
    }
  }
  for (const auto& [object, place] : goals) goal += " (at " + object + " " + place + ")";
  return Parse(domain, "(define (problem logistics) (:domain logistics) (:objects" + objects + ")\n(:init" +
                           init + ")\n(:goal (and" + goal + ")))\n");
}
/// Instances 4-0 and 6-0 of the competition: 20 and 25 actions.
inline std::shared_ptr<const Problem> Logistics4() {
  return Logistics(2, "apt2", {{"obj11", "apt1"}, {"obj23", "pos1"}, {"obj13", "apt1"}, {"obj21", "pos1"}});
}
inline std::shared_ptr<const Problem> Logistics6() {
  return Logistics(2, "apt1",
                   {{"obj12", "apt2"},
                    {"obj23", "apt1"},
                    {"obj21", "apt2"},
                    {"obj22", "pos2"},
                    {"obj13", "pos2"},
                    {"obj11", "apt2"}});
}

/// Typed, with hoists, trucks, pallets and crates: two crates change places between a depot and a
/// distributor.
inline std::shared_ptr<const Problem> Depot() {
  const std::string domain = R"((define (domain depot)
  (:requirements :typing)
  (:types place locatable - object  depot distributor - place  truck hoist surface - locatable
    pallet crate - surface)
  (:predicates (at ?x - locatable ?y - place) (on ?x - crate ?y - surface) (in ?x - crate ?y - truck)
    (lifting ?x - hoist ?y - crate) (available ?x - hoist) (clear ?x - surface))
  (:action drive :parameters (?x - truck ?y ?z - place) :precondition (at ?x ?y)
    :effect (and (not (at ?x ?y)) (at ?x ?z)))
  (:action lift :parameters (?x - hoist ?y - crate ?z - surface ?p - place)
    :precondition (and (at ?x ?p) (available ?x) (at ?y ?p) (on ?y ?z) (clear ?y))
    :effect (and (not (at ?y ?p)) (lifting ?x ?y) (not (clear ?y)) (not (available ?x)) (clear ?z) (not (on ?y ?z))))
  (:action drop :parameters (?x - hoist ?y - crate ?z - surface ?p - place)
    :precondition (and (at ?x ?p) (at ?z ?p) (clear ?z) (lifting ?x ?y))
    :effect (and (available ?x) (not (lifting ?x ?y)) (at ?y ?p) (not (clear ?z)) (clear ?y) (on ?y ?z)))
  (:action load :parameters (?x - hoist ?y - crate ?z - truck ?p - place)
    :precondition (and (at ?x ?p) (at ?z ?p) (lifting ?x ?y))
    :effect (and (not (lifting ?x ?y)) (in ?y ?z) (available ?x)))
  (:action unload :parameters (?x - hoist ?y - crate ?z - truck ?p - place)
    :precondition (and (at ?x ?p) (at ?z ?p) (available ?x) (in ?y ?z))
    :effect (and (not (in ?y ?z)) (not (available ?x)) (lifting ?x ?y))))
)";
  return Parse(domain, R"((define (problem depot) (:domain depot)
  (:objects depot0 - depot distributor0 distributor1 - distributor truck0 truck1 - truck
    pallet0 pallet1 pallet2 - pallet crate0 crate1 - crate hoist0 hoist1 hoist2 - hoist)
  (:init (at pallet0 depot0) (clear crate1) (at pallet1 distributor0) (clear crate0) (at pallet2 distributor1)
    (clear pallet2) (at truck0 distributor1) (at truck1 depot0) (at hoist0 depot0) (available hoist0)
    (at hoist1 distributor0) (available hoist1) (at hoist2 distributor1) (available hoist2)
    (at crate0 distributor0) (on crate0 pallet1) (at crate1 depot0) (on crate1 pallet0))
  (:goal (and (on crate0 pallet2) (on crate1 pallet1))))
)");
}

}  // namespace tether::symbolic::domains
