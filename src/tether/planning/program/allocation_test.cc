#include <gtest/gtest.h>

#include "testing/common/heap_counter.h"
#include "testing/planning/test_scene.h"
#include "tether/nlp/solver.h"
#include "tether/planning/program/program_builder.h"
#include "tether/planning/skeleton/action_reader.h"

#ifdef TETHER_COUNTS_ALLOCATIONS
namespace tether::planning {
namespace {

/// A residual of zero that records the allocations at each evaluation of the program.
class Probe final : public nlp::Residual {
 public:
  explicit Probe(std::vector<long>& counts)
      : Residual("probe", 0, 1, nlp::Unit::kNone, {{nlp::BlockRef::Kind::kPose, 0}}), counts_(counts) {}
  void Evaluate(const nlp::Point&, nlp::VectorRef r, nlp::JacobianRef* J) const override {
    counts_.push_back(heap_allocations);
    r[0] = 0;
    if (J != nullptr) J->setZero();
  }

 private:
  std::vector<long>& counts_;
};

TEST(AllocationTest, APlanningProgramIsSolvedWithoutAllocating) {
  const Problem problem = ReachProblem();
  const SceneFacts facts(problem);
  const auto steps = BindSkeleton(
      problem, {"pick(hook)", "push(hook,box,table)", "place(hook,table)", "pick(box)", "place(box,shelf)"});
  KeyPoseProgram key_poses = BuildProgram(facts, steps);
  std::vector<long> counts;
  counts.reserve(1000);
  key_poses.program.Add(std::make_shared<Probe>(counts), nlp::Role::kCost);
  const auto solver = nlp::MakeSolver(nlp::Backend::kNative);
  heap_allocations = 0;
  const nlp::Result result = solver->Solve(key_poses.program, key_poses.guess, nlp::Options());
  ASSERT_TRUE(result.ok()) << result.Summary();
  ASSERT_GT(counts.size(), 3u);
  EXPECT_GT(counts.front(), 0);
  // The last evaluation belongs to the verdict.
  EXPECT_EQ(counts[counts.size() - 2], counts.front());
}

}  // namespace
}  // namespace tether::planning
#endif
