#include <vector>

#include <benchmark/benchmark.h>

#include "testing/ltl/random_formula.h"
#include "tether/common/random.h"
#include "tether/ltl/automaton/automaton.h"
#include "tether/ltl/automaton/lazy_automaton.h"
#include "tether/ltl/formula/parser.h"

namespace tether::ltl {
namespace {

/// From the text to the minimal automaton: 3ⁿ states.
void BM_TwoStepTasks(benchmark::State& state) {
  const std::string text = testing::TwoStepTasks(static_cast<int>(state.range(0)));
  int states = 0;
  for (auto _ : state) {
    const auto automaton = BuildAutomaton(ParseFormula(text), Semantics::kCosafe);
    states = automaton->states();
    benchmark::DoNotOptimize(automaton);
  }
  state.counters["states"] = states;
}
BENCHMARK(BM_TwoStepTasks)->DenseRange(1, 10)->Unit(benchmark::kMillisecond);

/// Paper B, eq. (21): 12 states.
void BM_Assistive(benchmark::State& state) {
  const std::string text =
      "F(in(pen,person) & in(book,person)) & F(in(meat,heat) & X F(in(meat,person) & in(salad,person))) & "
      "F(in(book,book_place) & in(pen,pen_place))";
  for (auto _ : state) {
    const auto automaton = BuildAutomaton(ParseFormula(text), Semantics::kCosafe);
    benchmark::DoNotOptimize(automaton);
  }
}
BENCHMARK(BM_Assistive)->Unit(benchmark::kMicrosecond);

/// One step of a search's automaton along random words; states are created when they are first reached.
void BM_LazyStep(benchmark::State& state) {
  LazyAutomaton automaton(ParseFormula(testing::TwoStepTasks(static_cast<int>(state.range(0)))),
                          Semantics::kCosafe);
  Random random(1);
  std::vector<uint64_t> letters(1 << 16);
  for (uint64_t& letter : letters) letter = random.Next() & random.Next() & random.Next() & random.Next();
  int at = automaton.initial();
  size_t i = 0;
  for (auto _ : state) {
    at = automaton.Step(at, letters[i++ % letters.size()]);
    if (automaton.IsSettled(at)) at = automaton.initial();
  }
  state.counters["states"] = automaton.states();
}
BENCHMARK(BM_LazyStep)->Arg(3)->Arg(8)->Arg(12);

}  // namespace
}  // namespace tether::ltl
