#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tether/ltl/automaton/diagram.h"
#include "tether/ltl/formula/core.h"
#include "tether/ltl/formula/progression.h"

namespace tether::ltl {

/// Makes minimal automata of subformulas of one core.
class Compiler {
 public:
  /// `core` must outlive the compiler.
  Compiler(const Core& core, const DiagramLimits& limits);

  /// Empty if the limits were exceeded.
  std::optional<Diagram> Compile(Core::Ref f);

  /// The minimal automaton of the words that all of `parts` accept, which are minimal; the smallest are
  /// combined first. `parts` is not empty.
  std::optional<Diagram> IntersectAll(std::vector<Diagram> parts) const;

 private:
  std::optional<Diagram> CompileConjunction(Core::Ref f);
  std::optional<Diagram> CompileByProgression(Core::Ref f);
  Target Convert(Bdd::Ref transition);

  const Core& core_;
  DiagramLimits limits_;
  std::unique_ptr<Progression> progression_;
  // While one formula is progressed:
  Diagram diagram_;
  std::vector<Progression::State> states_;
  TripleMap state_numbers_;
  TripleMap converted_;
};

}  // namespace tether::ltl
