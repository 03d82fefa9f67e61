#include "tether/task/skeleton.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace tether::task {
namespace {

using symbolic::ReadProblem;
using symbolic::Task;

std::shared_ptr<const Task> Shipped(const std::string& name) {
  const std::string folder = std::string(TETHER_SOURCE_DIR) + "/scenarios/" + name;
  return Task::Ground(ReadProblem(folder + "/domain.pddl", folder + "/problem.pddl"));
}

std::string Join(const Skeleton& skeleton, const Task& task) {
  std::string text;
  for (int action : skeleton.actions) {
    text += (text.empty() ? "" : " ") + task.actions()[static_cast<size_t>(action)].name;
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

}  // namespace
}  // namespace tether::task
