#include "tether/scenario/scenario.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "testing/scenario/test_scenarios.h"
#include "tether/common/file.h"
#include "tether/scenario/scene_reader.h"

namespace tether::scenario {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const std::string kSource = TETHER_SOURCE_DIR;

/// A folder with small PDDL files and an action library, for scenarios that tests write.
class ScenarioTest : public ::testing::Test {
 protected:
  void SetUp() override {
    Write("domain.pddl", R"((define (domain small)
  (:requirements :strips :typing)
  (:types thing)
  (:predicates (inhand ?a - thing) (on ?a ?b - thing))
  (:action pick :parameters (?a - thing) :precondition (not (inhand ?a)) :effect (inhand ?a))
  (:action place :parameters (?a ?b - thing) :precondition (inhand ?a) :effect (and (not (inhand ?a)) (on ?a ?b))))
)");
    Write("problem.pddl", R"((define (problem p) (:domain small)
  (:objects cup shelf - thing)
  (:init)
  (:goal (on cup shelf)))
)");
  }

  std::string Write(const std::string& name, const std::string& text) const {
    WriteFile(folder_ + "/" + name, text);
    return folder_ + "/" + name;
  }

  /// Every message of loading a scenario with this text; its folder is left out of them.
  std::string ErrorOf(const std::string& text) const {
    try {
      LoadScenario(Write("s.yaml", text));
    } catch (const InputError& error) {
      return Without(error.what(), folder_ + "/");
    }
    return "";
  }

  ScratchFolder scratch_;
  const std::string folder_ = scratch_.path().string();
};

const std::string kSmall = R"(format: tether.scenario/1
robots: {panda: {model: panda}}
objects:
  shelf: {shape: {box: [0.3, 0.3, 0.1]}, pose: {position: [0.5, 0, 0.05]}}
  cup: {shape: {cylinder: {radius: 0.03, length: 0.1}}, mass: 0.2, pose: {parent: shelf, position: [0, 0, 0.1]}}
task: {domain: domain.pddl, problem: problem.pddl, max_actions: 3}
actions: [manipulation]
)";

TEST_F(ScenarioTest, EveryShippedScenarioLoads) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kSource + "/scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    ++count;
    const Scenario scenario = LoadScenario(entry.path().string());
    EXPECT_FALSE(scenario.title.empty()) << entry.path();
    ASSERT_NE(scenario.problem, nullptr) << entry.path();
    EXPECT_EQ(scenario.models.size(), scenario.scene.robots.size());
    const std::string events = entry.path().parent_path() / entry.path().stem();
    if (!std::filesystem::exists(events)) continue;
    for (const auto& file : std::filesystem::directory_iterator(events)) {
      if (file.path().extension() == ".yaml") {
        EXPECT_FALSE(ReadEvents(file.path().string(), {&scenario.scene, &scenario.actions}).empty());
      }
    }
  }
  EXPECT_GE(count, 4);
}

TEST_F(ScenarioTest, WorkspaceReachIsThePapersScene) {
  const Scenario scenario = LoadScenario(kSource + "/scenarios/workspace_reach.yaml");
  EXPECT_EQ(scenario.title, "Workspace Reach");
  EXPECT_TRUE(scenario.scene.InitialPose("box").p.isApprox(Eigen::Vector3d(0.9, 0, 0.025), 1e-12));
  EXPECT_TRUE(scenario.scene.InitialPose("hook").p.isApprox(Eigen::Vector3d(0.9, 0.3, 0.01), 1e-12));
  EXPECT_TRUE(scenario.scene.FindObject("hook")->shape.is_compound());
  EXPECT_FALSE(scenario.scene.FindObject("table")->movable());
  EXPECT_EQ(scenario.scene.robots[0].q.size(), 7u);
  EXPECT_EQ(scenario.task.max_actions, 5);
  ASSERT_EQ(scenario.constraints.size(), 1u);
  EXPECT_EQ(scenario.constraints[0].spec.kind, "inside");
  EXPECT_FALSE(scenario.constraints[0].relax.has_value());
  EXPECT_TRUE(scenario.events.empty());
  EXPECT_EQ(scenario.perturb.position, 0.01);
}

TEST_F(ScenarioTest, ASmallScenarioLoadsWithDefaults) {
  const Scenario scenario = LoadScenario(Write("s.yaml", kSmall));
  EXPECT_EQ(scenario.title, "s");
  EXPECT_EQ(scenario.seed, 0u);
  EXPECT_EQ(scenario.scene.robots[0].q.size(), 7u);
  EXPECT_EQ(scenario.execution.rate, 1000);
  EXPECT_EQ(scenario.planning.solver, nlp::Backend::kNative);
  EXPECT_TRUE(scenario.planning.home);
}

TEST_F(ScenarioTest, ShapesPosesAndRegionsMeanWhatTheySay) {
  const Scenario scenario = LoadScenario(Write("s.yaml", R"(format: tether.scenario/1
objects:
  ball: {shape: {sphere: 0.1}, rgba: [1, 0, 0, 0.5], pose: {parent: turned, position: [1, 0, 0]}}
  turned: {shape: {box: [1, 2, 3]}, pose: {quaternion_wxyz: [2, 0, 0, 2]}}
  tool:
    shape:
    - {capsule: {radius: 0.1, length: 0.5}}
    - {cylinder: {radius: 0.2, length: 0.4}, pose: {position: [0, 0, 1], rpy: [0, 0, 0.5]}}
regions:
  spot: {disc: 0.06, capacity: 1, dwell: 5, pose: {parent: turned, position: [0, 0, 1.5]}}
  patch: {rectangle: [0.2, 0.3]}
  hub: {sphere: 0.05, hub: true}
groups: {places: [spot, patch]}
task: {goal: {ltl: 'F(in(ball, spot))', semantics: ltlf
}
}
constraints:
- inside: {frame: moved, of: hub, relax: 2}
events:
- {when: {time: 2}, move: {object: ball, to: {parent: turned, position: [0, 0, 2]}, over: 0.5}}
)"));
  EXPECT_TRUE(scenario.scene.InitialPose("ball").p.isApprox(Eigen::Vector3d(0, 1, 0), 1e-12));
  const geometry::Shape& tool = scenario.scene.FindObject("tool")->shape;
  EXPECT_EQ(std::get<geometry::Cylinder>(tool.parts[1].primitive).length, 0.4);
  EXPECT_EQ(tool.parts[1].X_SP.p.z(), 1);
  const scene::Region& spot = *scenario.scene.FindRegion("spot");
  EXPECT_EQ(std::get<scene::Disc>(spot.form).radius, 0.06);
  EXPECT_EQ(spot.capacity, 1);
  EXPECT_EQ(spot.dwell, 5);
  EXPECT_TRUE(scenario.scene.FindRegion("hub")->hub);
  EXPECT_EQ(scenario.task.semantics, ltl::Semantics::kLtlf);
  EXPECT_EQ(scenario.constraints[0].relax, 2);
  EXPECT_EQ(scenario.constraints[0].spec.parameters.Find("relax"), nullptr);
  EXPECT_TRUE(scenario.events[0].has_goal);
  EXPECT_EQ(scenario.problem, nullptr);
}

TEST_F(ScenarioTest, UnknownKeysAndNamesCarryTheNearestMatch) {
  const std::string errors = ErrorOf(R"(format: tether.scenario/1
titel: x
robots: {panda: {model: pandaa}}
objects:
  shelf: {shape: {bx: [0.3, 0.3, 0.1]}, pos: {position: [0.5, 0, 0.05]}}
  cup: {shape: {box: [0.1, 0.1, 0.1]}, mas: 1, pose: {parent: shelv, position: [0, 0, 0.1]}}
task: {domain: domain.pddl, problem: problem.pddl, max_action: 3}
actions: [manipulatoin]
constraints:
- insid: {frame: moved, of: cup}
planning: {solver: ipop}
events:
- when: {starts: pik(cup)}
  move: {object: cupp, by: [0, 0, 0.1], over: 1}
)");
  EXPECT_THAT(errors, HasSubstr("s.yaml:2:1: unknown key 'titel' in the scenario (did you mean 'title'?"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:3:25: "));
  EXPECT_THAT(errors, HasSubstr("pandaa"));
  EXPECT_THAT(
      errors,
      HasSubstr("s.yaml:5:19: unknown shape 'bx' of object 'shelf' (did you mean 'box'? accepted: box, "
                "sphere, capsule, cylinder, hull or mesh)"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:5:41: unknown key 'pos' in object 'shelf' (did you mean 'pose'?"));
  EXPECT_THAT(errors, HasSubstr("unknown key 'mas' in object 'cup' (did you mean 'mass'?"));
  EXPECT_THAT(
      errors,
      HasSubstr("s.yaml:6:63: unknown parent 'shelv' of 'cup' (did you mean 'shelf'? accepted: world, "
                "panda, shelf or cup)"));
  EXPECT_THAT(errors, HasSubstr("unknown key 'max_action' in 'task' (did you mean 'max_actions'?"));
  EXPECT_THAT(errors,
              HasSubstr("s.yaml:8:11: unknown action library 'manipulatoin' (did you mean 'manipulation'?"));
  EXPECT_THAT(
      errors,
      HasSubstr("s.yaml:10:3: unknown constraint 'insid' in 'constraints' of the scenario (did you mean "
                "'inside'?"));
  EXPECT_THAT(errors, HasSubstr("'solver' of 'planning' is 'ipop' (did you mean 'ipopt'?"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:14:18: unknown object 'cupp' in event (did you mean 'cup'?"));
}

TEST_F(ScenarioTest, NumbersMustBeFiniteAndInRange) {
  const std::string errors = ErrorOf(R"(format: tether.scenario/1
seed: -1
robots: {panda: {model: panda, q: [0, 0, 0]}}
objects:
  a: {shape: {box: [0.3, -0.3, 0.1]}, pose: {position: [.nan, 0, 0]}}
  b: {shape: {sphere: 0}, mass: -1, friction: -0.1, pose: {quaternion_wxyz: [0, 0, 0, 0]}}
  c: {shape: {capsule: {radius: 0.1}}, rgba: [2, 0, 0, 1], pose: {rpy: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0]}}
  d: {shape: []}
  e: {shape: {box: [1, 1]}}
regions:
  r: {disc: .inf}
  s: {capacity: 1}
planning: {weights: {translation: -1}}
execution: {rate: 0}
perturb: {position: -0.1}
events:
- {when: {time: -1}, move: {object: a, by: [1, 0, 0], over: 0}}
)");
  EXPECT_THAT(errors, HasSubstr("s.yaml:2:7: 'seed' of the scenario is '-1'"));
  EXPECT_THAT(errors,
              HasSubstr("'q' of robot 'panda' is a list of 3 (a list of 7 finite numbers is accepted)"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:5:26: box of object 'a' has the size -0.3"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:5:57: 'position' of pose of object 'a' has the entry '.nan'"));
  EXPECT_THAT(errors, HasSubstr("sphere of object 'b' is '0' (a finite number above zero is accepted)"));
  EXPECT_THAT(errors, HasSubstr("'mass' of object 'b' is '-1'"));
  EXPECT_THAT(errors, HasSubstr("'friction' of object 'b' is negative"));
  EXPECT_THAT(errors, HasSubstr("'quaternion_wxyz' of pose of object 'b' has length zero"));
  EXPECT_THAT(errors, HasSubstr("capsule of object 'c' lacks 'length'"));
  EXPECT_THAT(errors, HasSubstr("'rgba' of object 'c' is out of range"));
  EXPECT_THAT(errors,
              HasSubstr("pose of object 'c' has two orientations (rpy or quaternion_wxyz, not both)"));
  EXPECT_THAT(errors, HasSubstr("shape of object 'd' is an empty list"));
  EXPECT_THAT(errors, HasSubstr("box of object 'e' is a list of 2 (a list of 3 finite numbers is accepted)"));
  EXPECT_THAT(errors, HasSubstr("'disc' of region 'r' is '.inf'"));
  EXPECT_THAT(
      errors,
      HasSubstr(
          "region 's' has no form (one of disc, rectangle, box, sphere, capsule, cylinder, hull or mesh)"));
  EXPECT_THAT(errors, HasSubstr("'translation' of 'weights' of 'planning' is negative"));
  EXPECT_THAT(errors, HasSubstr("'rate' of 'execution' (Hz) is '0'"));
  EXPECT_THAT(errors, HasSubstr("'position' of 'perturb' is negative"));
  EXPECT_THAT(errors, HasSubstr("'time' of event is negative"));
  EXPECT_THAT(errors, HasSubstr("'over' of event is '0'"));
}

TEST_F(ScenarioTest, CyclesAreToldOnce) {
  const std::string errors = ErrorOf(R"(format: tether.scenario/1
objects:
  a: {shape: {sphere: 1}, pose: {parent: b}}
  b: {shape: {sphere: 1}, pose: {parent: c}}
  c: {shape: {sphere: 1}, pose: {parent: a}}
  d: {shape: {sphere: 1}, pose: {parent: a}}
  e: {shape: {sphere: 1}, pose: {parent: e}}
)");
  EXPECT_EQ(errors,
            "s.yaml:3:42: a cycle among parents: a → b → c → a (each chain of parents ends at world)\n"
            "s.yaml:7:42: a cycle among parents: e → e (each chain of parents ends at world)");
}

TEST_F(ScenarioTest, NamesAreOneNamespace) {
  const std::string errors = ErrorOf(R"(format: tether.scenario/1
objects:
  hand: {shape: {sphere: 1}}
  a: {shape: {sphere: 1}}
  b c: {shape: {sphere: 1}}
regions:
  a: {disc: 1}
  world: {disc: 1}
groups: {g: [aa]}
)");
  EXPECT_THAT(errors, HasSubstr("s.yaml:3:3: the name 'hand' is reserved"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:5:3: 'b c' is not a name"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:7:3: the name 'a' is taken, at line 4"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:8:3: the name 'world' is reserved"));
  EXPECT_THAT(errors, HasSubstr("s.yaml:9:14: unknown region 'aa' in group 'g' (did you mean 'a'?"));
}

TEST_F(ScenarioTest, MissingFilesAreNamedWhereTheyAreAskedFor) {
  EXPECT_THAT(
      ErrorOf(
          "format: tether.scenario/1\ntask: {domain: no.pddl, problem: problem.pddl}\nactions: [no.yaml]\n"
          "events: gone.yaml\n"),
      ::testing::AllOf(HasSubstr("s.yaml:2:16: 'domain' of 'task': there is no file 'no.pddl'"),
                       HasSubstr("s.yaml:3:11: there is no file 'no.yaml'"),
                       HasSubstr("s.yaml:4:9: 'events': there is no file 'gone.yaml'")));
  try {
    LoadScenario(folder_ + "/missing.yaml");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("missing.yaml: cannot read this file"));
  }
}

TEST_F(ScenarioTest, PddlMustFitTheScene) {
  std::string text = kSmall;
  text.replace(text.find("  cup:"), 6, "  cap:");
  EXPECT_THAT(ErrorOf(text),
              HasSubstr("problem.pddl:2:13: PDDL object 'cup' is not in the scene s.yaml (did you mean "
                        "'cap'?"));
  Write("mine.yaml",
        "format: tether.actions/1\nplace: {parameters: [a], steps: [{control: a, target: world}]}\n");
  text = kSmall;
  text.replace(text.find("[manipulation]"), 14, "[mine.yaml]");
  const std::string errors = ErrorOf(text);
  EXPECT_THAT(errors, HasSubstr("domain.pddl:5:"));
  EXPECT_THAT(errors, HasSubstr("action 'pick' has no geometry (accepted: place)"));
  EXPECT_THAT(errors, HasSubstr("action 'place' has 2 parameters, but its geometry (mine.yaml:2:1) has 1"));
}

TEST_F(ScenarioTest, MistakesOfAllFilesComeTogether) {
  Write("problem.pddl",
        "(define (problem p) (:domain small)\n  (:objects cup shelf - thing)\n  (:init)\n"
        "  (:goal (on cup shelf))))\n");
  std::string text = kSmall + "perturb: {positoin: 0.01}\n";
  const std::string errors = ErrorOf(text);
  EXPECT_THAT(errors, HasSubstr("problem.pddl:4:"));
  EXPECT_THAT(errors,
              HasSubstr("s.yaml:8:11: unknown key 'positoin' in 'perturb' (did you mean 'position'?"));
}

TEST_F(ScenarioTest, PartsOfFixedCompoundsMayHaveNames) {
  const auto with = [](const std::string& parts, const std::string& more = "") {
    std::string text = kSmall;
    const std::string before = "objects:\n";
    return text.insert(text.find(before) + before.size(), "  rack: {shape: " + parts + more + "}\n");
  };
  const std::string two =
      "[{box: [1, 1, 0.1], name: board}, {box: [1, 1, 0.1], pose: {position: [0, 0, 1]}}]";
  EXPECT_EQ(ErrorOf(with(two)), "");
  EXPECT_THAT(ErrorOf(with(two, ", mass: 1")),
              HasSubstr("a part of object 'rack' has a name, but the object has a mass (names for parts of "
                        "objects that are fixed)"));
  EXPECT_THAT(ErrorOf(with("[{box: [1, 1, 0.1], name: board}]")),
              HasSubstr("every part of object 'rack' has a name (at least one part without"));
  EXPECT_THAT(ErrorOf(with("{box: [1, 1, 0.1], name: board}")),
              HasSubstr("the only part of object 'rack' has a name"));
  EXPECT_THAT(ErrorOf(with("[{box: [1, 1, 0.1], name: cup}, {sphere: 0.1}]")),
              HasSubstr("the name 'cup' is taken"));
  EXPECT_THAT(ErrorOf(with("[{box: [1, 1, 0.1], name: ''}, {sphere: 0.1}]")), HasSubstr("is empty"));
}

TEST_F(ScenarioTest, FramesOfConstraintsAreInTheScene) {
  EXPECT_EQ(
      ErrorOf(kSmall + "constraints:\n- inside: {frame: movd, of: shelf}\n- inside: {frame: moved, of: "
                       "shelv}\n"),
      "s.yaml:9:19: constraint 'inside' names 'movd', which is not in the scene (did you mean 'moved'? "
      "accepted: hand, moved, world, panda, shelf or cup)\n"
      "s.yaml:10:30: constraint 'inside' names 'shelv', which is not in the scene (did you mean 'shelf'? "
      "accepted: hand, moved, world, panda, shelf or cup)");
  EXPECT_EQ(ErrorOf(kSmall + "constraints:\n- inside: {frame: cup, of: cup}\n"),
            "s.yaml:9:3: constraint 'inside' names 'cup' twice (different frames)");
  for (const char* key : {"gain", "damping"}) {
    EXPECT_THAT(ErrorOf(kSmall + "execution: {" + key + ": 0}\n"), HasSubstr(std::string("s.yaml:8:")));
  }
  // A tag without a value, too, is an empty text.
  for (const char* empty : {"''", "!!shelf"}) {
    EXPECT_EQ(ErrorOf(kSmall + "constraints:\n- inside: {frame: moved, of: " + empty + "}\n"),
              "s.yaml:9:30: 'of' of constraint 'inside' is empty (text is accepted)");
  }
  Write("mine.yaml",
        "format: tether.actions/1\npick: {parameters: [a], steps: [{control: hand, target: a, constraints: "
        "[inside: {frame: hand, of: b}]}]}\n");
  std::string text = kSmall;
  text.replace(text.find("[manipulation]"), 14, "[manipulation, mine.yaml]");
  EXPECT_THAT(ErrorOf(text), HasSubstr("mine.yaml:2:100: constraint 'inside' names 'b', which is not in the "
                                       "scene (accepted: a, hand, moved, world, panda, shelf or cup)"));
}

TEST_F(ScenarioTest, AMissingLibraryIsOneMistake) {
  std::string text = kSmall;
  text.replace(text.find("[manipulation]"), 14, "[manipulaton]");
  const std::string errors = ErrorOf(text);
  EXPECT_THAT(errors, HasSubstr("unknown action library 'manipulaton' (did you mean 'manipulation'?"));
  EXPECT_THAT(errors, ::testing::Not(HasSubstr("has no geometry")));

  text = kSmall;
  text.replace(text.find("[manipulation]"), 14, "manipulation");
  EXPECT_THAT(ErrorOf(text), ::testing::AllOf(HasSubstr("'manipulation' (a list of names is accepted)"),
                                              ::testing::Not(HasSubstr("has no geometry"))));
}

TEST_F(ScenarioTest, AFileThatAKeyNamesIsNamed) {
  std::string text = kSmall;
  text.replace(text.find("model: panda"), 12, "model: robots/gone.yaml");
  EXPECT_THAT(ErrorOf(text),
              ::testing::AllOf(HasSubstr("s.yaml:"), HasSubstr("robots/gone.yaml: cannot read")));
}

TEST_F(ScenarioTest, AFileThatIsNoScenarioIsOneMistake) {
  EXPECT_EQ(ErrorOf("format: tether.events/1\nevents: []\n"),
            "s.yaml:1:9: format is 'tether.events/1' (accepted: tether.scenario/1)");
  EXPECT_EQ(
      ErrorOf(""),
      "s.yaml: there is nothing in this file (a scenario, which begins with format: tether.scenario/1)");
}

TEST_F(ScenarioTest, GoalsReplaceTheProblems) {
  std::string text = kSmall;
  text.replace(text.find("max_actions: 3"), 14, "goal: {pddl: (inhand cup)}");
  const Scenario scenario = LoadScenario(Write("s.yaml", text));
  EXPECT_EQ(scenario.problem->goal.kind, symbolic::Formula::Kind::kAtom);
  EXPECT_EQ(scenario.problem->goal.predicate, scenario.problem->domain->FindPredicate("inhand"));
  text.replace(text.find("inhand cup"), 10, "inhnd cup");
  EXPECT_THAT(ErrorOf(text), HasSubstr("inhnd"));
}

TEST_F(ScenarioTest, EventsReadBothSpellings) {
  const Scenario scenario = LoadScenario(Write("s.yaml", kSmall + R"(events:
- {when: {starts: place(cup,shelf)}, move: {object: shelf, by: [0, 0.05, 0], yaw: 0.1, over: 1}}
- {when: {starts: 'pick( cup )'}, move: {
object:
  cup, by : [ 0, 0.05, 0 ], over : 1
}
}
)"));
  EXPECT_EQ(scenario.events[0].starts, "place(cup,shelf)");
  EXPECT_EQ(scenario.events[1].starts, "pick(cup)");
  EXPECT_EQ(scenario.events[1].Describe(), "move cup by (0, 0.05, 0) m over 1 s");
  EXPECT_THAT(ErrorOf(kSmall + "events:\n- {when: {starts: place(cup)}, move: {object: cup, over: 1}}\n"),
              ::testing::AllOf(HasSubstr("action 'place(cup)' in event has 1 arguments (it takes 2)"),
                               HasSubstr("'move' of event needs one destination")));
}

TEST_F(ScenarioTest, AnArmMayBePushed) {
  const std::string event = kSmall + "events:\n- when: {time: 1}\n  push: {robot: panda, torques: ";
  const Scenario scenario = LoadScenario(Write("s.yaml", event + "[0, 5, 0, 0, 0, 0, 1], over: 0.3}\n"));
  EXPECT_EQ(scenario.events[0].robot, "panda");
  EXPECT_EQ(scenario.events[0].torques[1], 5);
  EXPECT_EQ(scenario.events[0].Describe(), "push panda by (0, 5, 0, 0, 0, 0, 1) Nm over 0.3 s");
  EXPECT_THAT(ErrorOf(event + "[0, 5], over: 0.3}\n"), HasSubstr("'torques' of event"));
  EXPECT_THAT(
      ErrorOf(kSmall + "events:\n- when: {time: 1}\n  push: {robot: pandra, torques: [1], over: 1}\n"),
      HasSubstr("unknown robot 'pandra' in event"));
}

TEST_F(ScenarioTest, ThereAreManyKindsOfEventsAndMoments) {
  const Scenario scenario = LoadScenario(Write("s.yaml", kSmall + R"(events:
- {when: {step: 1}, rotate: {object: cup, by: 1.5, over: 1}}
- {when: {ends: place(cup,shelf), after: 0.2}, knock: {object: cup, impulse: [0.1, 0, 0], at: [0, 0, 0.03]}}
- {when: {random: [1, 4]}, pull: {by: [0, 0, -0.1], force: 30}}
- {when: {time: 2}, remove: {object: cup}}
- {when: {time: 3}, add: {object: cup, pose: {position: [0.4, 0, 0.1]}}}
- {when: {time: 0}, set: {object: cup, mass: 1, friction: 0.2, size: 0.003}}
- {when: {time: 1}, push_arm: {robot: panda, torques: [0, 5, 0, 0, 0, 0, 1], over: 0.3}}
)"));
  const std::vector<Event>& events = scenario.events;
  EXPECT_EQ(events[0].step, 1);
  EXPECT_NEAR(math::LogSO3(events[0].X_by.R).z(), 1.5, 1e-12);
  EXPECT_EQ(events[1].ends, "place(cup,shelf)");
  EXPECT_EQ(events[1].after, 0.2);
  EXPECT_EQ(std::get<Knock>(events[1].other).at.z(), 0.03);
  EXPECT_EQ(events[2].until, 4);
  EXPECT_EQ(events[2].Describe(), "pull what is held by (0, 0, -0.1) m over 0.5 s with up to 30 N");
  EXPECT_TRUE(std::holds_alternative<Removal>(events[3].other));
  EXPECT_TRUE(events[4].has_goal);
  EXPECT_EQ(events[5].Describe(), "set cup: mass 1 kg friction 0.2 size 0.003 m more");
  EXPECT_EQ(events[6].robot, "panda");
}

TEST_F(ScenarioTest, EventsThatMakeNoSenseAreNamed) {
  const auto error = [&](const std::string& event) { return ErrorOf(kSmall + "events:\n- " + event + "\n"); };
  const std::string now = "when: {time: 1}, ";
  EXPECT_THAT(error("{" + now + "remove: {object: shelf}}"), HasSubstr("object 'shelf' in event is fixed"));
  EXPECT_THAT(error("{" + now + "remove: {object: cap}}"), HasSubstr("unknown object 'cap' in event"));
  EXPECT_THAT(error("{" + now + "add: {object: cup}}"), HasSubstr("which no event removes"));
  EXPECT_THAT(error("{" + now + "set: {object: cup}}"), HasSubstr("sets nothing"));
  EXPECT_THAT(error("{" + now + "knock: {object: cup, impulse: [1]}}"), HasSubstr("'impulse' of event"));
  EXPECT_THAT(error("{" + now + "goal: '(on cup'}"), HasSubstr("s.yaml:"));
  EXPECT_THAT(error("{" + now + "goal: 'F('}"), HasSubstr("s.yaml:"));
  EXPECT_THAT(error("{when: {random: [4, 1]}, remove: {object: cup}}"), HasSubstr("no range of time"));
  EXPECT_THAT(error("{when: {time: 1, after: 2}, remove: {object: cup}}"),
              HasSubstr("'after' beside a time"));
  EXPECT_THAT(
      error("{" + now + "remove: {object: cup}}\n- {" + now + "move: {object: cup, by: [0, 1, 0], over: 1}}"),
      HasSubstr("contradicts 'remove cup' of the same moment"));
  EXPECT_THAT(error("{when: {time: 1}}"), HasSubstr("'move'"));
}

TEST_F(ScenarioTest, SensorsMayLackWhatIsSaid) {
  const Scenario scenario = LoadScenario(Write(
      "s.yaml", kSmall +
                    "sensing: {torques: {noise: 0.3, bias: 0.5, mass_error: 0.1, delay: 0.005}, "
                    "noise: {position: 0.003, rotation: 0.005}, rate: 30, latency: 0.1, dropout: 0.1}\n"));
  EXPECT_EQ(scenario.sensing.torque_noise, 0.3);
  EXPECT_EQ(scenario.sensing.mass_error, 0.1);
  EXPECT_EQ(scenario.sensing.pose_rate, 30);
  EXPECT_FALSE(scenario.sensing.exact_poses());
  EXPECT_THAT(ErrorOf(kSmall + "sensing: {torques: {noise: -1}}\n"), HasSubstr("'noise'"));
  EXPECT_THAT(ErrorOf(kSmall + "sensing: {delay: 0.1}\n"), HasSubstr("accepted: "));
}

TEST_F(ScenarioTest, JointLimitsThatLeaveNoRoomAreRefused) {
  EXPECT_EQ(ErrorOf(kSmall + "constraints: [joint_limits: {margin: 1.4}]\n"), "");
  EXPECT_THAT(ErrorOf(kSmall + "constraints: [joint_limits: {margin: 1.6}]\n"),
              HasSubstr("'margin' of joint_limits is 1.6 rad, which leaves joint4 of 'panda' no room"));
}

TEST(SplitActionTest, TakesWhatIsAnAction) {
  EXPECT_EQ(SplitAction("f()"), std::vector<std::string>{"f"});
  EXPECT_EQ(SplitAction("f(a, b)"), (std::vector<std::string>{"f", "a", "b"}));
  EXPECT_TRUE(SplitAction("f").empty());
  EXPECT_TRUE(SplitAction("f(a").empty());
  EXPECT_TRUE(SplitAction("f(a,)").empty());
}

}  // namespace
}  // namespace tether::scenario
