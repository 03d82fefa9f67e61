#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tether/scenario/scenario.h"

namespace tether::scenario {

/// How large a generated scene is. Each kind reads only what concerns it; see GeneratorKinds().
struct GeneratorParameters {
  int blocks = 3;   ///< hanoi, stack: 2 to 8; around: 1 to 4.
  int objects = 6;  ///< sort, bin: 1 to 8; shelf: 1 to 6; clutter, posts: 0 to 12, crowd: 0 to 200 obstacles.
  int regions = 2;  ///< sort: 1 to 4 trays; shelf: 1 or 2 compartments.
};

/// A scenario as texts, nothing of it on disk. The scenario names its PDDL files `domain.pddl` and
/// `problem.pddl`, beside itself.
struct GeneratedScenario {
  std::string scenario;  ///< Format `tether.scenario/1`.
  std::string domain;    ///< PDDL
  std::string problem;   ///< PDDL
};

/// The kinds of scenes, each with one line of explanation: hanoi, reach, stack, sort, bin, clutter,
/// crowd, around, posts, shelf.
std::vector<std::pair<std::string, std::string>> GeneratorKinds();

/// A random scene. The same kind, parameters and seed give the same texts, byte for byte, on every platform;
/// docs/generators.md gives the distributions. What it makes is physically sensible: movable things stand on
/// something, nothing touches anything else, and the facts of :init are those of the geometry. Throws
/// InputError for an unknown kind or a parameter out of range.
GeneratedScenario Generate(const std::string& kind, const GeneratorParameters& parameters, uint64_t seed);

/// The scenario read as from files, without touching the disk.
Scenario LoadGenerated(const GeneratedScenario& generated);

/// Writes scenario.yaml, domain.pddl and problem.pddl to a folder, which is made if it is not there. Returns
/// the path of the scenario. Throws InputError if one of them exists already, unless `overwrite`, and if the
/// folder can't be written.
std::string WriteGenerated(const GeneratedScenario& generated, const std::string& folder, bool overwrite);

}  // namespace tether::scenario
