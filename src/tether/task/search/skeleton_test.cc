#include "tether/task/search/skeleton.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/symbolic/naive.h"
#include "tether/common/document/value.h"
#include "tether/common/file.h"
#include "tether/common/random.h"

namespace tether::task {
namespace {

using symbolic::ReadProblem;
using symbolic::Task;
using symbolic::naive::Facts;

std::shared_ptr<const Task> Shipped(const std::string& name) {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name;
  return Task::Ground(ReadProblem(folder + "/domain.pddl", folder + "/problem.pddl"));
}

std::string Join(const Skeleton& skeleton, const Task& task) {
  std::string text;
  for (const ActionId action : skeleton.actions) {
    text += (text.empty() ? "" : " ") + task.actions()[action].name;
  }
  return text;
}

std::vector<std::string> All(SkeletonSearch& search, SearchStatus* last) {
  std::vector<std::string> found;
  while (true) {
    const SearchOutcome outcome = search.Next();
    *last = outcome.status;
    if (!outcome.found()) return found;
    found.push_back(Join(*outcome.skeleton, search.task()));
  }
}

std::vector<ActionId> Ids(const std::vector<int>& numbers) { return {numbers.begin(), numbers.end()}; }

TEST(ConflictTest, RulesOutWhatItIsAbout) {
  Conflict conflict;
  conflict.prefix = Ids({3, 5});
  EXPECT_TRUE(conflict.RulesOut(Ids({3, 5, 1})));
  EXPECT_FALSE(conflict.RulesOut(Ids({3, 1, 5})));
  EXPECT_FALSE(conflict.RulesOut(Ids({3})));
  conflict.unless = Ids({1, 2});
  EXPECT_TRUE(conflict.RulesOut(Ids({4, 5})));
  EXPECT_TRUE(conflict.RulesOut(Ids({4, 5, 1})));
  EXPECT_FALSE(conflict.RulesOut(Ids({4, 2, 5})));
  EXPECT_FALSE(conflict.RulesOut(Ids({4, 6})));
  conflict.unless.clear();
  conflict.anywhere = true;
  EXPECT_TRUE(conflict.RulesOut(Ids({4, 2, 5})));
  EXPECT_FALSE(conflict.RulesOut(Ids({4, 2})));
}

TEST(SkeletonTest, WorkspaceReachHasThePapersThreeCandidates) {
  SkeletonSearch search(Shipped("workspace_reach"), {.max_actions = 5});
  SearchStatus last;
  EXPECT_THAT(
      All(search, &last),
      testing::ElementsAre("pick(hook) push(hook,box,table) place(hook,table) pick(box) place(box,shelf)",
                           "pick(hook) push(hook,box,table) place(hook,shelf) pick(box) place(box,shelf)",
                           "pick(hook) push(hook,box,table) place(hook,box) pick(box) place(box,shelf)"));
  EXPECT_EQ(last, SearchStatus::kDepthLimit);
}

TEST(SkeletonTest, HanoiHasTwoCandidatesOfFourteenActions) {
  SkeletonSearch search(Shipped("hanoi"), {.max_actions = 14});
  SearchStatus last;
  const std::vector<std::string> found = All(search, &last);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_THAT(found[0], testing::HasSubstr("place(box_3,platform_left)"));
  EXPECT_THAT(found[1], testing::HasSubstr("place(box_3,platform_middle)"));
  EXPECT_EQ(last, SearchStatus::kDepthLimit);
}

/// The oracle: extends every sequence by every action, breadth first.
std::vector<std::string> GrowTree(const symbolic::Problem& problem, int max_actions, bool skip_revisits,
                                  size_t max_nodes, bool* complete) {
  struct Node {
    std::string names;
    std::vector<Facts> states;
  };
  std::vector<std::string> found;
  std::vector<Node> layer = {{"", {symbolic::naive::Initial(problem)}}};
  *complete = true;
  size_t nodes = 0;
  for (int length = 0; length <= max_actions && !layer.empty(); ++length) {
    std::vector<Node> next;
    for (const Node& node : layer) {
      if (symbolic::naive::Holds(problem, problem.goal, node.states.back(), {})) {
        found.push_back(node.names);
        continue;
      }
      if (length == max_actions) continue;
      for (const symbolic::naive::Step& step : symbolic::naive::Steps(problem, node.states.back())) {
        if (skip_revisits && std::count(node.states.begin(), node.states.end(), step.after) > 0) continue;
        next.push_back({node.names + (node.names.empty() ? "" : " ") + step.name, node.states});
        next.back().states.push_back(step.after);
        if (++nodes > max_nodes) {
          *complete = false;
          return found;
        }
      }
    }
    layer = std::move(next);
  }
  return found;
}

void ExpectSameCandidates(const std::shared_ptr<const symbolic::Problem>& problem, int max_actions,
                          bool skip_revisits, int* compared) {
  bool complete;
  const std::vector<std::string> expected = GrowTree(*problem, max_actions, skip_revisits, 3000, &complete);
  if (!complete) return;
  SkeletonSearch search(Task::Ground(problem), {.max_actions = max_actions, .skip_revisits = skip_revisits});
  SearchStatus last;
  EXPECT_EQ(All(search, &last), expected);
  EXPECT_TRUE(last == SearchStatus::kExhausted || last == SearchStatus::kDepthLimit);
  *compared += static_cast<int>(expected.size());
  if (last == SearchStatus::kExhausted) {
    // Then nothing longer may exist.
    const std::vector<std::string> more = GrowTree(*problem, max_actions + 2, skip_revisits, 3000, &complete);
    EXPECT_TRUE(!complete || more == expected);
  }
}

TEST(SkeletonTest, AgreesWithTheTreeOnRandomDomains) {
  int compared = 0;
  for (uint64_t seed = 0; seed < 1500; ++seed) {
    const symbolic::naive::RandomProblem random(seed);
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + random.domain() + random.problem());
    const auto problem =
        symbolic::ParseProblem(random.problem(), "p", symbolic::ParseDomain(random.domain(), "d"));
    ExpectSameCandidates(problem, 1 + static_cast<int>(seed % 5), seed % 3 != 0, &compared);
    if (HasFailure()) return;
  }
  EXPECT_GT(compared, 1000);
}

const char* const kGripper = R"((define (domain gripper)
  (:types room ball)
  (:predicates (at ?r - room) (in ?b - ball ?r - room) (held ?b - ball) (joined ?a ?b - room))
  (:action go :parameters (?a ?b - room) :precondition (and (at ?a) (joined ?a ?b))
    :effect (and (not (at ?a)) (at ?b)))
  (:action take :parameters (?b - ball ?r - room)
    :precondition (and (at ?r) (in ?b ?r) (not (exists (?c - ball) (held ?c))))
    :effect (and (held ?b) (not (in ?b ?r))))
  (:action drop :parameters (?b - ball ?r - room) :precondition (and (at ?r) (held ?b))
    :effect (and (in ?b ?r) (not (held ?b))))))";

std::shared_ptr<const symbolic::Problem> RandomGripper(uint64_t seed, int rooms, int balls) {
  Random random(seed);
  auto room = [&] { return "r" + std::to_string(random.Index(rooms)); };
  std::string objects, init = "(at " + room() + ")", goal;
  for (int i = 0; i < rooms; ++i) objects += " r" + std::to_string(i);
  objects += " - room";
  for (int i = 0; i + 1 < rooms; ++i) {
    const std::string a = " r" + std::to_string(i), b = " r" + std::to_string(i + 1);
    init += " (joined" + a + b + ") (joined" + b + a + ")";
  }
  for (int i = 0; i < balls; ++i) {
    const std::string ball = "b" + std::to_string(i);
    objects += " " + ball;
    init += " (in " + ball + " " + room() + ")";
    goal += " (in " + ball + " " + room() + ")";
  }
  return symbolic::ParseProblem("(define (problem p) (:domain gripper) (:objects" + objects +
                                    " - ball) (:init " + init + ") (:goal (and" + goal + ")))",
                                "p", symbolic::ParseDomain(kGripper, "d"));
}

TEST(SkeletonTest, AgreesWithTheTreeOnGripper) {
  int compared = 0;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    ExpectSameCandidates(RandomGripper(seed, 2 + static_cast<int>(seed % 3), 1 + static_cast<int>(seed % 2)),
                         3 + static_cast<int>(seed % 6), seed % 2 == 0, &compared);
    if (HasFailure()) return;
  }
  EXPECT_GT(compared, 60);
}

TEST(SkeletonTest, EnumeratesUntilNothingIsLeft) {
  // Without a limit: every sequence that never returns to a state, then the proof that there is no other.
  SkeletonSearch search(Task::Ground(RandomGripper(4, 3, 1)));
  SearchStatus last;
  const std::vector<std::string> found = All(search, &last);
  EXPECT_EQ(last, SearchStatus::kExhausted);
  bool complete;
  EXPECT_EQ(found, GrowTree(search.task().problem(), 100, true, 1'000'000, &complete));
  EXPECT_TRUE(complete);
  EXPECT_EQ(search.Next().status, SearchStatus::kExhausted);
}

TEST(SkeletonTest, TellsImpossibleFromTooDeep) {
  const auto base = RandomGripper(4, 3, 1);
  auto status = [&](const std::string& goal, int max_actions) {
    SkeletonSearch search(Task::Ground(symbolic::WithGoal(*base, goal, {})), {.max_actions = max_actions});
    return search.Next().status;
  };
  EXPECT_EQ(status("(and (at r0) (at r1))", 0), SearchStatus::kExhausted);
  EXPECT_EQ(status("(and (at r0) (at r1))", 50), SearchStatus::kExhausted);
  EXPECT_EQ(status("(and (at r0) (at r1))", 1), SearchStatus::kDepthLimit);
  EXPECT_EQ(status("(and (in b0 r0) (at r2))", 1), SearchStatus::kDepthLimit);
  EXPECT_EQ(status("(and (in b0 r0) (at r2))", 50), SearchStatus::kFound);
}

TEST(SkeletonTest, AGoalThatHoldsNeedsNoAction) {
  SkeletonSearch search(Task::Ground(symbolic::WithGoal(*RandomGripper(4, 3, 1), "(and)", {})));
  const SearchOutcome outcome = search.Next();
  ASSERT_TRUE(outcome.found());
  EXPECT_TRUE(outcome.skeleton->actions.empty());
  EXPECT_EQ(search.Next().status, SearchStatus::kExhausted);
}

TEST(SkeletonTest, ConflictsRuleOutWhatBeginsWithThem) {
  Random random(3);
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const auto task = Task::Ground(RandomGripper(seed, 3, 2));
    std::vector<std::vector<ActionId>> without, with, prefixes;
    SkeletonSearch plain(task, {.max_actions = 12});
    while (const auto skeleton = plain.Next().skeleton) without.push_back(skeleton->actions);
    SkeletonSearch search(task, {.max_actions = 12});
    auto begins = [](const std::vector<ActionId>& actions, const std::vector<ActionId>& prefix) {
      return prefix.size() <= actions.size() && std::equal(prefix.begin(), prefix.end(), actions.begin());
    };
    std::vector<std::vector<ActionId>> expected;
    size_t next = 0;
    while (const auto skeleton = search.Next().skeleton) {
      // The next one of the plain search that no prefix so far rules out.
      auto ruled_out = [&](const std::vector<ActionId>& actions) {
        return std::any_of(prefixes.begin(), prefixes.end(),
                           [&](const auto& prefix) { return begins(actions, prefix); });
      };
      while (next < without.size() && ruled_out(without[next])) ++next;
      ASSERT_LT(next, without.size());
      ASSERT_EQ(skeleton->actions, without[next++]);
      if (random.Index(2) == 0 && !skeleton->actions.empty()) {
        Conflict conflict;
        conflict.kind = Conflict::Kind::kProved;
        conflict.prefix = skeleton->actions;
        conflict.prefix.resize(
            static_cast<size_t>(2 + random.Index(static_cast<int>(skeleton->actions.size()))) - 1);
        prefixes.push_back(conflict.prefix);
        search.AddConflict(conflict);
      }
    }
    for (; next < without.size(); ++next) {
      EXPECT_TRUE(std::any_of(prefixes.begin(), prefixes.end(),
                              [&](const auto& p) { return begins(without[next], p); }));
    }
  }
}

TEST(SkeletonTest, ConflictsThatGaveUpAreNoProof) {
  const auto task = Task::Ground(RandomGripper(4, 3, 1));
  for (const auto kind : {Conflict::Kind::kProved, Conflict::Kind::kGaveUp}) {
    SkeletonSearch search(task);
    Conflict everything;
    everything.kind = kind;
    search.AddConflict(everything);
    EXPECT_EQ(search.Next().status,
              kind == Conflict::Kind::kProved ? SearchStatus::kExhausted : SearchStatus::kPruned);
  }
}

TEST(SkeletonTest, ActionsThatWereGivenUpAnywhereAreNoProof) {
  // Each action in turn fails anywhere, until no sequence is left.
  const auto task = Task::Ground(RandomGripper(4, 3, 1));
  for (const auto kind : {Conflict::Kind::kProved, Conflict::Kind::kGaveUp}) {
    SkeletonSearch search(task);
    SearchOutcome outcome = search.Next();
    for (int count = 0; outcome.found(); ++count) {
      ASSERT_LT(count, static_cast<int>(task->actions().size()));
      Conflict conflict;
      conflict.kind = kind;
      conflict.prefix = {outcome.skeleton->actions.front()};
      conflict.anywhere = true;
      search.AddConflict(conflict);
      outcome = search.Next();
    }
    EXPECT_EQ(outcome.status,
              kind == Conflict::Kind::kProved ? SearchStatus::kExhausted : SearchStatus::kPruned);
  }
}

TEST(SkeletonTest, StopsWhenAskedAndGoesOn) {
  const auto task = Shipped("hanoi");
  SkeletonSearch plain(task, {.max_actions = 16}), stopped(task, {.max_actions = 16});
  std::stop_source source;
  source.request_stop();
  const SearchLimits over{{.deadline = std::chrono::steady_clock::time_point{}}};
  while (true) {
    EXPECT_EQ(stopped.Next({{.stop = source.get_token()}}).status, SearchStatus::kInterrupted);
    EXPECT_EQ(stopped.Next(over).status, SearchStatus::kTimeLimit);
    const SearchOutcome a = plain.Next(), b = stopped.Next();
    ASSERT_EQ(a.status, b.status);
    if (!a.found()) break;
    EXPECT_EQ(a.skeleton->actions, b.skeleton->actions);
  }
  SkeletonSearch small(task, {.max_states = 10});
  EXPECT_EQ(small.Next().status, SearchStatus::kStateLimit);
}

std::shared_ptr<const symbolic::Problem> Hanoi(int discs) {
  const std::string text = ReadFile(std::string(TETHER_SOURCE_DIR) + "/scenarios/hanoi/domain.pddl");
  std::string objects, init, goal;
  for (int i = 1; i <= discs; ++i) {
    const std::string disc = "d" + std::to_string(i);
    objects += " " + disc;
    for (const char* plate : {"platform_left", "platform_middle", "platform_right"}) {
      init += " (smaller " + disc + " " + plate + ")";
    }
    for (int k = i + 1; k <= discs; ++k) init += " (smaller " + disc + " d" + std::to_string(k) + ")";
    const std::string below = " d" + std::to_string(i + 1);
    init += " (on " + disc + (i == discs ? " platform_right" : below) + ")";
    goal += " (on " + disc + (i == discs ? " platform_left" : below) + ")";
  }
  return symbolic::ParseProblem("(define (problem p) (:domain hanoi) (:objects" + objects +
                                    " - movable) (:init " + init + ") (:goal (and" + goal + ")))",
                                "p", symbolic::ParseDomain(text, "d"));
}

TEST(SkeletonTest, TallTowersTakeTwiceTheClassicNumberOfMoves) {
  for (int discs = 1; discs <= 7; ++discs) {
    SkeletonSearch search(Task::Ground(Hanoi(discs)));
    const SearchOutcome first = search.Next();
    ASSERT_TRUE(first.found());
    EXPECT_EQ(first.skeleton->actions.size(), 2u * ((1u << discs) - 1));
    std::set<std::vector<ActionId>> seen = {first.skeleton->actions};
    size_t length = first.skeleton->actions.size();
    for (int i = 0; discs > 1 && i < 50; ++i) {
      const SearchOutcome next = search.Next();
      if (!next.found()) break;
      EXPECT_GE(next.skeleton->actions.size(), length);
      length = next.skeleton->actions.size();
      EXPECT_TRUE(seen.insert(next.skeleton->actions).second);
    }
  }
}

TEST(SkeletonTest, OptionsSayWhatIsWrong) {
  try {
    SkeletonOptions{.max_actions = -3}.Validate();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "max_actions is -3 (accepted: a positive number, or 0 for no limit)");
  }
}

}  // namespace
}  // namespace tether::task
