#include "tether/execution/sequencer/executive.h"

#include <cmath>
#include <cstdlib>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/heap_counter.h"
#include "testing/execution/test_plans.h"
#include "tether/common/error.h"
#include "tether/execution/sequencer/resolved_plan.h"

namespace tether::execution {
namespace {

using math::Pose;
using testing::HasSubstr;

const geometry::Shape kCube = geometry::Primitive(geometry::Box{{0.05, 0.05, 0.05}});

scene::Scene TwoBoxes() {
  scene::Scene scene = TableScene();
  scene.objects.push_back(MakeObject("box", kCube, Pose(Eigen::Vector3d(0.5, 0.15, 0.025))));
  scene.objects.push_back(MakeObject("other", kCube, Pose(Eigen::Vector3d(0.5, -0.15, 0.025))));
  return scene;
}

std::map<std::string, std::shared_ptr<const robot::Model>> Models() {
  return {{"panda", robot::Model::Load("panda")}};
}

planning::Plan PickAndPlace() {
  return PlanBuilder()
      .Pick("box", TopGrasp({0, 0, 0}))
      .Place("box", "other", Pose(Eigen::Vector3d(0, 0, 0.05)))
      .Build();
}

// An arm that follows no command: what the executive sees is set by hand.
struct Seen {
  Seen() {
    robot::Observation& seen = observations["panda"];
    seen.q = Models()["panda"]->home();
    seen.v = Eigen::VectorXd::Zero(7);
    seen.tau_external = Eigen::VectorXd::Zero(7);
    seen.gripper_opening = 0.08;
    const scene::Scene scene = TwoBoxes();
    for (const auto& object : scene.objects) estimate.X_WO[object.name] = scene.InitialPose(object.name);
  }
  void Tick() {
    observations["panda"].time += 0.001;
    estimate.time += 0.001;
  }
  robot::Observations observations;
  scene::WorldEstimate estimate;
};

std::string ErrorOf(const planning::Plan& plan) {
  try {
    const Executive executive(TwoBoxes(), Models(), plan);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Executive, RefusesWhatItCannotExecute) {
  EXPECT_EQ(ErrorOf(PickAndPlace()), "");
  planning::Plan plan = PickAndPlace();
  plan.steps[0].target = "bxo";
  plan.steps[1].target = "tabel";
  plan.steps[1].X_TC.p.x() = std::numeric_limits<double>::quiet_NaN();
  const std::string all = ErrorOf(plan);
  EXPECT_THAT(all, HasSubstr("unknown target frame 'bxo'"));
  EXPECT_THAT(all, HasSubstr("'box'?"));
  EXPECT_THAT(all, HasSubstr("unknown target frame 'tabel'"));
  EXPECT_THAT(all, HasSubstr("the pose is not finite"));

  plan = PickAndPlace();
  plan.robot = "pandra";
  EXPECT_THAT(ErrorOf(plan), HasSubstr("the plan is for robot 'pandra'"));

  plan = PickAndPlace();
  plan.steps[1].control = "other";
  plan.steps[1].target = "table";
  planning::SetModes(&plan);
  EXPECT_THAT(ErrorOf(plan), HasSubstr("'other' is not held, and no step before brings 'box' to it"));

  plan = PickAndPlace();
  std::get<planning::ReachVerb>(plan.steps[0].execute[1]).objective = "plane_distance";
  EXPECT_THAT(ErrorOf(plan), HasSubstr("reach with objective 'plane_distance'"));

  plan = PickAndPlace();
  std::get<planning::GripperVerb>(plan.steps[0].execute[3]).close_on = "hand";
  EXPECT_THAT(ErrorOf(plan), HasSubstr("the gripper closes on 'hand', which is not an object"));

  ExecutiveOptions options;
  options.leash = 0;
  EXPECT_THROW(Executive(TwoBoxes(), Models(), PickAndPlace(), options), InputError);
}

TEST(Executive, ResolvesWhoPushes) {
  scene::Scene scene = TwoBoxes();
  const Pose X_OtherBox(Eigen::Vector3d(0.06, 0, 0));
  const planning::Plan plan =
      PlanBuilder()
          .Pick("box", TopGrasp({0, 0, 0}))
          .Push("box", "other", "table", X_OtherBox, Pose(Eigen::Vector3d(0, 0, 0.275)))
          .Place("box", "table", Pose(Eigen::Vector3d(0.2, 0, 0.275)))
          .Build();
  const ResolvedPlan resolved = Resolve(scene, plan);
  EXPECT_FALSE(resolved.steps[1].push);
  EXPECT_TRUE(resolved.steps[2].push);
  EXPECT_EQ(resolved.steps[2].tool, ObjectId(1));
  EXPECT_EQ(resolved.steps[2].control, ObjectId(2));
  EXPECT_EQ(resolved.steps[2].X_CTool.p, X_OtherBox.p);
  EXPECT_EQ(resolved.steps[2].action_start, 1);
  EXPECT_EQ(resolved.steps[3].grasp_step, 0);
}

TEST(Executive, RegionsAreTargets) {
  scene::Scene scene = TwoBoxes();
  scene::Region region;
  region.name = "goal";
  region.form = scene::Disc{0.1};
  region.parent = "other";
  region.X_ParentRegion = Pose(Eigen::Vector3d(0, 0, 0.025));
  scene.regions.push_back(region);
  planning::Plan plan = PickAndPlace();
  plan.steps[1].target = "goal";
  const ResolvedPlan resolved = Resolve(scene, plan);
  EXPECT_EQ(resolved.steps[1].target.object, ObjectId(2));
  EXPECT_EQ(resolved.steps[1].target.X_OF.p.z(), 0.025);
}

TEST(Executive, StaysSafeWhenSensorsFail) {
  Executive executive(TwoBoxes(), Models(), PickAndPlace());
  Seen seen;
  for (int i = 0; i < 100; ++i, seen.Tick()) executive.Step(seen.estimate, seen.observations);
  const Eigen::VectorXd good = seen.observations["panda"].q;
  seen.observations["panda"].q[3] = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 10; ++i, seen.Tick()) {
    const Eigen::VectorXd& torque = executive.Step(seen.estimate, seen.observations).at("panda").torque;
    ASSERT_TRUE(torque.allFinite());
  }
  EXPECT_EQ(executive.events().back().kind, EventKind::kFault);
  EXPECT_EQ(executive.events().back().text, "what is measured of 'panda' is not finite; it is not believed");
  seen.observations["panda"].q = good;
  seen.estimate.X_WO["box"].p.y() = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 10; ++i, seen.Tick()) {
    ASSERT_TRUE(executive.Step(seen.estimate, seen.observations).at("panda").torque.allFinite());
  }
  EXPECT_EQ(executive.events().back().kind, EventKind::kEstimateInvalid);
  seen.estimate.X_WO.erase("box");
  ASSERT_TRUE(executive.Step(seen.estimate, seen.observations).at("panda").torque.allFinite());
}

// An arm that can't move: the verb stalls, is tried again as often as allowed, and then the plan fails in
// words.
TEST(Executive, GivesUpAfterItsRetries) {
  ExecutiveOptions options;
  options.max_retries = 1;
  Executive executive(TwoBoxes(), Models(), PickAndPlace(), options);
  Seen seen;
  for (int i = 0; i < 40000 && executive.running(); ++i, seen.Tick()) {
    executive.Step(seen.estimate, seen.observations);
  }
  EXPECT_EQ(executive.status().state, ExecutiveStatus::State::kFailed);
  EXPECT_THAT(executive.status().reason, HasSubstr("pick(box): the reach stalled"));
  EXPECT_EQ(executive.retries(), 1);
  EXPECT_EQ(executive.events().back().kind, EventKind::kFailed);
}

TEST(Executive, ConstrainedTorquesStayFiniteAndWithinTheirRateWhateverIsMeasured) {
  ExecutiveOptions options;
  options.constrained = true;
  Executive executive(TwoBoxes(), Models(), PickAndPlace(), options);
  Seen seen;
  const Eigen::VectorXd good = seen.observations["panda"].q;
  Eigen::VectorXd last;
  for (int i = 0; i < 300; ++i, seen.Tick()) {
    seen.observations["panda"].q = good;
    if (i > 100 && i < 150) seen.observations["panda"].q[2] = std::nan("");
    if (i > 200) seen.estimate.X_WO["box"].p.y() = std::numeric_limits<double>::infinity();
    const Eigen::VectorXd torque = executive.Step(seen.estimate, seen.observations).at("panda").torque;
    ASSERT_TRUE(torque.allFinite()) << i;
    if (last.size() == torque.size()) {
      ASSERT_LE((torque - last).cwiseAbs().maxCoeff(), 1 + 1e-9) << i;
    }
    last = torque;
  }
  bool said = false;
  for (const Event& event : executive.events()) said = said || event.kind == EventKind::kFault;
  EXPECT_TRUE(said);
}

TEST(Executive, EventsAreValues) {
  const Value value = ToValue({1.5, EventKind::kGraspLost, 3, "'box' slipped away"});
  EXPECT_EQ(
      WriteJson(value, 0),
      WriteJson(ParseYaml("{time_s: 1.5, kind: grasp_lost, step: 3, text: \"'box' slipped away\"}", "x"), 0));
}

#ifdef TETHER_COUNTS_ALLOCATIONS
TEST(Executive, TicksAllocateNothing) {
  for (const bool constrained : {false, true}) {
    ExecutiveOptions options;
    options.constrained = constrained;
    Executive executive(TwoBoxes(), Models(), PickAndPlace(), options);
    Seen seen;
    long allocated = 0;
    size_t events = 0;
    int quiet = 0;
    for (int i = 0; i < 3000; ++i) {
      seen.Tick();
      const long before = heap_allocations;
      executive.Step(seen.estimate, seen.observations);
      const long after = heap_allocations;
      if (executive.events().size() == events) {
        allocated += after - before;
        ++quiet;
      }
      events = executive.events().size();
    }
    EXPECT_EQ(allocated, 0) << constrained;
    EXPECT_GT(quiet, 2900);
  }
}
#endif

}  // namespace
}  // namespace tether::execution
