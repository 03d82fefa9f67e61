#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tether/math/pose.h"
#include "tether/planning/plan/plan.h"
#include "tether/symbolic/grounding/task.h"
#include "tether/task/goal/product.h"

namespace tether::execution {

/// The state to plan from, as it is estimated.
struct PlanRequest {
  std::map<std::string, math::Pose> X_WO;
  Eigen::VectorXd q;                                 ///< n, rad: of the plan's robot.
  std::string held;                                  ///< The object in the hand; empty: none.
  std::vector<std::string> unseen;                   ///< Objects that have not been seen for long.
  std::shared_ptr<const symbolic::Problem> problem;  ///< What facts are named by, with its goal.
  std::vector<symbolic::Fact> facts;                 ///< All that hold.
  /// In place of the problem's goal: with the letters from the start and after each action so far, up to the
  /// last that was before this state.
  std::optional<task::TemporalGoal> goal;
  /// Actions that failed twice since the last that succeeded: the plan should not begin with one of them.
  std::vector<std::string> failed;
};

/// One time that a plan was asked for while it ran.
struct PlanningRecord {
  double asked = 0;      ///< s
  double adopted = -1;   ///< s; −1: there was none.
  double cpu = 0;        ///< CPU time of planning, s: differs from run to run.
  std::string decision;  ///< "resumed": with actions of the plan from one of them on; "replanned": others;
                         ///< "finished": nothing is left to do; "none": there was no plan.
  std::string reason;
  std::vector<std::string> actions;
};

/// What planning anew gave: without a plan, `reason` says why.
struct PlanAnswer {
  std::optional<planning::Plan> plan;
  std::shared_ptr<const symbolic::Task> task;  ///< With the requested state as its initial one.
  /// The temporal goal that was planned for: that of the request without what is broken.
  std::optional<task::TemporalGoal> goal;
  /// Conjuncts of the temporal goal that nothing can make true any more.
  std::vector<std::string> broken;
  std::string reason;
  double cpu = 0;  ///< s, that it took.
};

/// Plans for the run's goal from another state. Called by a thread of its own; deterministic.
using PlanAnew = std::function<PlanAnswer(const PlanRequest&)>;

/// The loop around a plan: facts are observed, and where they no longer allow the plan, another one is made.
struct ReplanningOptions {
  PlanAnew plan_anew;                          ///< None: the plan is executed as it is.
  std::shared_ptr<const symbolic::Task> task;  ///< Of the plan that is begun with.
  std::optional<task::TemporalGoal> goal;      ///< In place of the task's own goal.
  double latency = 0.02;  ///< A new plan is adopted so long after it was asked for, s …
  bool waits = true;      ///< … and waited for then; else, adopted once it is there.
  double verify = 0.3;    ///< So long after the last action the goal is looked at, s.
  int max_plans = 20;     ///< So many new plans in a run.
  int max_failures = 10;  ///< So many times in a row no plan may be found …
  double wait = 1;        ///< … so far apart, s.
};

}  // namespace tether::execution
