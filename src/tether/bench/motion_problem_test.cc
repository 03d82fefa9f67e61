#include "tether/bench/motion_problem.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "testing/common/scratch_folder.h"
#include "tether/bench/bench_motion.h"
#include "tether/common/file.h"

namespace tether::bench {
namespace {

using testing::HasSubstr;
using testing::SizeIs;
using testing::StartsWith;

std::string Scene(const std::string& objects) {
  return "name: test\nrobot_model_name: panda\nworld:\n  collision_objects:\n" + objects;
}

// A shelf's board to one side, a can to the other.
constexpr const char* kObjects = R"(    - id: board
      primitives:
        - {type: box, dimensions: [0.4, 0.4, 0.02]}
      primitive_poses:
        - {position: [0.6, 0.4, 0.5], orientation: [0, 0, 0.7071068, 0.7071068]}
    - id: can
      primitive_poses:
        - {position: [0.5, -0.4, 0.1], orientation: [0, 0, 0, 1]}
      primitives:
        - {type: cylinder, dimensions: [0.2, 0.03]}
)";
constexpr const char* kHat = R"(    - id: hat
      primitives:
        - {type: cone, dimensions: [0.2, 0.03]}
      primitive_poses:
        - {position: [0.5, -0.4, 0.1], orientation: [0, 0, 0, 1]}
)";

std::string Request(double first, double last) {
  std::string text =
      "start_state:\n  joint_state:\n"
      "    name: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6, "
      "panda_joint7, panda_finger_joint1, panda_finger_joint2]\n"
      "    position: [" +
      std::to_string(first) +
      ", -0.5, 0, -2.6, 0, 2.1, 0.8, 0.065, 0.065]\n"
      "goal_constraints:\n  - joint_constraints:\n";
  const double goal[] = {last, -0.2, 0.1, -2.2, 0.1, 2.0, 0.5};
  for (int i = 0; i < 7; ++i)
    text += "      - {joint_name: panda_joint" + std::to_string(i + 1) +
            ", position: " + std::to_string(goal[i]) + "}\n";
  return text;
}

class MotionProblemTest : public testing::Test {
 protected:
  void Write(const std::string& number, const std::string& scene, const std::string& request) {
    WriteFile(folder_.File("scene" + number + ".yaml"), scene);
    WriteFile(folder_.File("request" + number + ".yaml"), request);
  }
  MotionBench Bench() {
    MotionBenchOptions options;
    options.problems = folder_.path().string();
    return BenchmarkMotion(options, [](const MotionMeasurement&) {});
  }
  ScratchFolder folder_;
};

TEST_F(MotionProblemTest, ReadsScenesAndRequests) {
  Write("0001", Scene(kObjects), Request(-0.8, 0.8));
  const auto files = FindMotionProblems(folder_.path().string());
  ASSERT_THAT(files, SizeIs(1));
  EXPECT_EQ(files[0].name, "0001");
  const MotionProblem problem = ReadMotionProblem(files[0]);
  EXPECT_TRUE(problem.unknown.empty());
  ASSERT_THAT(problem.obstacles, SizeIs(2));
  EXPECT_EQ(problem.obstacles[0].name, "board");
  // Quaternions are x, y, z, w: a quarter turn about z.
  EXPECT_NEAR(problem.obstacles[0].shape.parts[0].X_SP.R(1, 0), 1, 1e-6);
  // Cylinders are height, radius.
  const auto& can = std::get<geometry::Cylinder>(problem.obstacles[1].shape.parts[0].primitive);
  EXPECT_EQ(can.length, 0.2);
  EXPECT_EQ(can.radius, 0.03);
  EXPECT_THAT(problem.start, SizeIs(9));
  ASSERT_THAT(problem.goals, SizeIs(1));
  EXPECT_EQ(problem.goals[0][0].position, 0.8);
}

TEST_F(MotionProblemTest, CountsWhatBecomesOfEach) {
  Write("0001", Scene(kObjects), Request(-0.8, 0.8));
  Write("0002", Scene(kObjects), Request(-0.8, 2.95));
  Write("0003", Scene(std::string(kObjects) + kHat), Request(-0.8, 0.8));
  Write("0004", Scene(R"(    - id: wall
      primitives: [{type: box, dimensions: [0.2, 2, 2]}]
      primitive_poses: [{position: [0.5, 0, 0], orientation: [0, 0, 0, 1]}]
)"),
        Request(0, 0.8));
  WriteFile(folder_.File("scene0005.yaml"), Scene(kObjects));
  const MotionBench bench = Bench();
  ASSERT_THAT(bench.rows, SizeIs(5));
  EXPECT_EQ(bench.rows[0].outcome, MotionOutcome::kSolved) << bench.rows[0].reason;
  EXPECT_EQ(bench.rows[1].outcome, MotionOutcome::kInvalid);
  EXPECT_EQ(bench.rows[1].reason, "at the goal, joint1 is at 2.9500, 0.0527 rad beyond its limit");
  EXPECT_EQ(bench.rows[2].outcome, MotionOutcome::kNotRead);
  EXPECT_EQ(bench.rows[2].reason, "we have no shape for cone (object 'hat')");
  EXPECT_EQ(bench.rows[3].outcome, MotionOutcome::kInvalid);
  EXPECT_THAT(bench.rows[3].reason, StartsWith("at the start, "));
  EXPECT_THAT(bench.rows[3].reason, HasSubstr(" mm inside wall"));
  EXPECT_EQ(bench.rows[4].outcome, MotionOutcome::kNotRead);
  EXPECT_THAT(bench.rows[4].reason, HasSubstr("problem '0005' has no request"));
  const Value json = WriteMotionBench(bench);
  EXPECT_EQ(json.Find("problems")->number(), 5);
  EXPECT_EQ(json.Find("invalid")->number(), 2);
  EXPECT_EQ(json.Find("solved")->number(), 1);
  EXPECT_EQ(json.Find("collisions")->number(), 0);
  EXPECT_EQ(json.Find("unknown_shapes")->Find("cone")->number(), 1);
  EXPECT_THAT(json.Find("failures")->items(), SizeIs(4));
  EXPECT_GT(json.Find("plan_s")->Find("median")->number(), 0);
}

TEST_F(MotionProblemTest, SaysWhatIsMalformed) {
  Write("0001", Scene(R"(    - id: board
      primitives: [{type: box, dimensions: [0.2, 2]}]
      primitive_poses: [{position: [0.5, 0, 0], orientation: [0, 0, 0, 0]}]
)"),
        "start_state: {}\ngoal_constraints: []\n");
  try {
    ReadMotionProblem(FindMotionProblems(folder_.path().string())[0]);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'orientation' of pose of object 'board' is zero"));
    EXPECT_THAT(error.what(), HasSubstr("'dimensions' of object 'board'"));
    EXPECT_THAT(error.what(), HasSubstr("scene0001.yaml:6"));
    EXPECT_THAT(error.what(), HasSubstr("start_state has no 'joint_state'"));
    EXPECT_THAT(error.what(), HasSubstr("goal_constraints is empty"));
  }
}

TEST_F(MotionProblemTest, AFolderWithoutProblemsIsAMistake) {
  EXPECT_THROW(FindMotionProblems(folder_.path().string()), InputError);
  EXPECT_THROW(FindMotionProblems(folder_.File("none")), InputError);
}

}  // namespace
}  // namespace tether::bench
