#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tether/common/error.h"
#include "tether/scene/scene.h"
#include "tether/symbolic/pddl/pddl.h"

namespace tether::planning {

/// The symbolic layout of a scene with regions.
struct RegionLayout {
  struct Place {
    std::string name;
    int capacity = 0;     ///< Objects that fit; 0: no limit.
    bool closed = false;  ///< Nothing may be placed there: a spot.
  };
  struct Item {
    std::string name;
    std::string region;  ///< Where it is at the start: where it is grasped, if it is in several; empty: in
                         ///< the hand.
    std::vector<std::string> others = {};  ///< The other regions that it is in then.
    bool unseen = false;                   ///< In no region, and nobody knows where.
  };
  std::string hub;      ///< It connects all regions.
  std::string at = {};  ///< Where the hand is at the start; empty: at the hub.
  std::vector<Place> regions;
  std::vector<Item> items;
  std::map<std::string, std::vector<std::string>> groups;
  /// (r, q): r lies within q, so that what is placed in r is in q too.
  std::vector<std::pair<std::string, std::string>> within = {};

  /// Some object is or may come to be in several regions.
  bool overlaps() const;
};

/// The text of the manipulation domain of paper B (section 3.1, after He et al., ICRA 2015), for scenes with
/// regions: MOVE and HOLD between the hub, which connects all regions, and a region; GRASP; PLACE into a
/// region that is free. Each costs 1. An object counts as in a region, and in the groups that this belongs
/// to, only when it is placed there.
const std::string& RegionDomainText();

/// The same actions where regions overlap: what is placed in a region is also in those around it, and needs
/// room there; what is grasped is in no region any more.
const std::string& OverlappingDomainText();

/// The problem of a layout in that domain. The goal is empty: everything reaches it.
std::string RegionProblemText(const RegionLayout& layout);

/// The domain and the problem with each region cut into `poses` places to put something, as He et al. do: the
/// hand moves to a pose, and a region still holds no more objects than its capacity. Poses are named after
/// their region and number: heat.3.
const std::string& PoseDomainText();
std::string PoseProblemText(const RegionLayout& layout, int poses);

/// The layout of a scene: movable objects are in the regions that geometry shows; where regions overlap, in
/// each that they fit in.
///
/// `where` says where each name of the scene was written, `task` where the task was. Adds a diagnostic for
/// each object in no region, each region with more objects than fit, and a hub that is missing or not the
/// only one; the layout is then invalid.
RegionLayout FindLayout(const scene::Scene& scene, const std::map<std::string, Location>& where,
                        const Location& task, Diagnostics& diagnostics);

/// A region beneath each movable object, which goes along with it: where it is when it is in no other. A
/// scene that has them can be planned for and run whatever is moved where.
scene::Scene WithSpots(const scene::Scene& scene);

/// What is so of a scene with spots while it runs, besides where its objects are.
struct RegionState {
  std::string at;                   ///< The region above which the hand is, or the hub.
  std::string held;                 ///< The item in the hand; empty: none.
  std::vector<std::string> unseen;  ///< Items of which nobody knows where they are.
};

/// The problem of a scene with spots in the middle of a run. An item in no region is at its spot; a region
/// may hold more than its capacity, then nothing more fits.
std::shared_ptr<const symbolic::Problem> MakeRegionProblem(const scene::Scene& scene,
                                                           const RegionState& state);

/// The problem of a scene with regions and without PDDL; null after mistakes, which go to `diagnostics`.
std::shared_ptr<const symbolic::Problem> MakeRegionProblem(const scene::Scene& scene,
                                                           const std::map<std::string, Location>& where,
                                                           const Location& task, Diagnostics& diagnostics);

}  // namespace tether::planning
