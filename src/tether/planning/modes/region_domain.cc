#include "tether/planning/modes/region_domain.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tether/common/text.h"
#include "tether/geometry/distance/bounds.h"
#include "tether/scene/region.h"
#include "tether/scene/resting_contact.h"
#include "tether/symbolic/pddl/expression.h"

namespace tether::planning {
namespace {

// A name that no frame of a scenario has: names there have no dots.
constexpr const char* kSpot = ".spot";

std::string SpotOf(const std::string& item) { return item + kSpot; }
bool IsSpot(const std::string& region) { return region.ends_with(kSpot); }

/// Finds the layout of a scene, and its mistakes.
class LayoutFinder {
 public:
  LayoutFinder(const scene::Scene& scene, const std::map<std::string, Location>& where, const Location& task,
               Diagnostics& diagnostics)
      : scene_(scene),
        where_(where),
        task_(task),
        diagnostics_(diagnostics),
        X_WO_(scene::InitialPoses(scene)) {}

  /// In the middle of a run: of a scene with spots.
  RegionLayout Find(const RegionState& state) {
    running_ = &state;
    RegionLayout layout = Find();
    const auto is_at = [&](const RegionLayout::Place& place) { return place.name == state.at; };
    if (std::any_of(layout.regions.begin(), layout.regions.end(), is_at)) layout.at = state.at;
    return layout;
  }

  RegionLayout Find() {
    for (const scene::Region& region : scene_.regions) {
      Declare(region.name);
      if (IsSpot(region.name)) continue;
      if (!region.hub) {
        layout_.regions.push_back({region.name, region.capacity});
      } else if (layout_.hub.empty()) {
        layout_.hub = region.name;
      } else {
        diagnostics_.Add(PlaceOf(region.name),
                         "a second hub '" + region.name + "' beside '" + layout_.hub + "'",
                         "one region with 'hub: true'");
      }
    }
    if (layout_.hub.empty()) {
      diagnostics_.Add(task_, "no region connects the others, so the task needs a PDDL domain",
                       "a region with 'hub: true', or 'domain' and 'problem'");
    }
    FindItems();
    FindWithin();
    // No more places than there are objects: each place is an object of the problem.
    for (RegionLayout::Place& place : layout_.regions)
      place.capacity = std::min(place.capacity, static_cast<int>(layout_.items.size()));
    layout_.groups = scene_.groups;
    for (const auto& [name, members] : scene_.groups) Declare(name);
    return std::move(layout_);
  }

 private:
  Location PlaceOf(const std::string& name) const {
    const auto found = where_.find(name);
    return found == where_.end() ? task_ : found->second;
  }

  /// PDDL does not tell upper from lower case.
  void Declare(const std::string& name) {
    const auto [first, fresh] = declared_.emplace(symbolic::LowerCase(name), name);
    if (fresh) return;
    diagnostics_.Add(PlaceOf(name), "'" + name + "' and '" + first->second + "' are one name in PDDL",
                     "names that differ in more than upper and lower case, or a PDDL domain");
  }

  void FindItems() {
    std::map<std::string, std::vector<std::string>> held;  // by region
    for (const scene::Object& object : scene_.objects) {
      if (!object.movable()) continue;
      Declare(object.name);
      if (running_ != nullptr && object.name == running_->held) {
        layout_.items.push_back({object.name, ""});
        continue;
      }
      if (running_ != nullptr && std::count(running_->unseen.begin(), running_->unseen.end(), object.name)) {
        layout_.items.push_back({object.name, "", {}, true});
        continue;
      }
      const std::vector<const scene::Region*> in = scene::FindRegionsOf(scene_, X_WO_, object);
      if (in.empty() && running_ != nullptr) {
        layout_.items.push_back({object.name, SpotOf(object.name)});
        layout_.regions.push_back({SpotOf(object.name), 1, true});
        continue;
      }
      if (in.empty()) {
        diagnostics_.Add(PlaceOf(object.name),
                         "object '" + object.name + "' is in no region" + Nearest(object),
                         "its whole footprint in a region, and standing there");
        continue;
      }
      RegionLayout::Item item{object.name, in.front()->name, {}};
      for (const scene::Region* region : in) {
        held[region->name].push_back(object.name);
        if (region != in.front()) item.others.push_back(region->name);
      }
      layout_.items.push_back(std::move(item));
    }
    if (running_ != nullptr) return;
    for (const scene::Region& region : scene_.regions) {
      const std::vector<std::string>& objects = held[region.name];
      if (region.capacity == 0 || static_cast<int>(objects.size()) <= region.capacity) continue;
      diagnostics_.Add(PlaceOf(objects[region.capacity]),
                       "region '" + region.name + "' holds " + std::to_string(objects.size()) + " objects, " +
                           JoinAnd(objects) + ", but has a capacity of " + std::to_string(region.capacity),
                       "no more objects than fit");
    }
  }

  /// Of flat regions in one plane, and of what else is no higher or lower than an object may stand.
  void FindWithin() {
    for (const scene::Region& inner : scene_.regions) {
      for (const scene::Region& outer : scene_.regions) {
        if (&inner == &outer || inner.hub || outer.hub || inner.parent != outer.parent) continue;
        const math::Pose X_OI = math::Between(outer.X_ParentRegion, inner.X_ParentRegion);
        if (X_OI.R.col(2).dot(Eigen::Vector3d::UnitZ()) < 1 - 1e-6 ||
            std::abs(X_OI.p.z()) > scene::RegionFit::kHeightTolerance)
          continue;
        const geometry::Polygon outline = scene::OutlinePolygon(outer.form);
        bool inside = true;
        for (const Eigen::Vector2d& p : scene::OutlinePolygon(inner.form)) {
          const Eigen::Vector2d q = (X_OI * Eigen::Vector3d(p.x(), p.y(), 0)).head<2>();
          inside = inside && geometry::ContainmentMargin(outline, q) > -scene::RegionFit::kOutlineTolerance;
        }
        if (inside) layout_.within.emplace_back(inner.name, outer.name);
      }
    }
  }

  static std::string JoinAnd(const std::vector<std::string>& names) {
    std::string text;
    for (size_t i = 0; i < names.size(); ++i)
      text += (i == 0 ? "'" : i + 1 < names.size() ? ", '" : " and '") + names[i] + "'";
    return text;
  }

  /// How far the object is from being in the region that it is nearest to.
  std::string Nearest(const scene::Object& object) const {
    std::string nearest;
    double least = std::numeric_limits<double>::infinity();
    for (const scene::Region& region : scene_.regions) {
      if (region.hub) continue;
      const scene::RegionFit fit = scene::FitRegion(region.form, scene::RegionPose(scene_, X_WO_, region),
                                                    object.shape, X_WO_.at(object.name));
      const double miss = std::max(fit.outside, 0.0) + fit.height;
      if (miss >= least) continue;
      least = miss;
      nearest = ": ";
      if (!(fit.outside <= scene::RegionFit::kOutlineTolerance)) {
        nearest +=
            "its footprint reaches " + Fixed(1e3 * fit.outside, 1) + " mm beyond '" + region.name + "'";
      } else {
        nearest += "it is " + Fixed(1e3 * fit.height, 1) + " mm above or below '" + region.name + "'";
      }
    }
    return nearest;
  }

  const scene::Scene& scene_;
  const std::map<std::string, Location>& where_;
  const Location& task_;
  Diagnostics& diagnostics_;
  const std::map<std::string, math::Pose> X_WO_;
  const RegionState* running_ =
      nullptr;  ///< Null: the layout is that of a scenario, which must be as it says.
  std::map<std::string, std::string> declared_;
  RegionLayout layout_;
};

/// A name that no frame of the scene has: names there have no dots.
std::string Numbered(const std::string& name, int n) { return name + "." + std::to_string(n); }

/// The objects and facts that both domains have.
class ProblemWriter {
 public:
  explicit ProblemWriter(const RegionLayout& layout) : layout_(layout) {
    Declare(layout.hub, "hub");
    init_ += " (at " + (layout.at.empty() ? layout.hub : layout.at) + ")";
    int most = 0;
    for (const RegionLayout::Place& region : layout.regions) {
      if (!region.closed) Declare(region.name, "region");
      if (region.capacity > 0) init_ += " (limited " + region.name + ")";
      most = std::max(most, region.capacity);
    }
    for (const auto& [name, members] : layout.groups) {
      Declare(name, "group");
      for (const std::string& member : members) init_ += " (member " + member + " " + name + ")";
    }
    std::map<std::string, int> held;
    for (const RegionLayout::Item& item : layout.items) {
      Declare(item.name, "item");
      if (item.region.empty()) {
        if (!item.unseen) holds_ = item.name;
        continue;
      }
      std::vector<std::string> in{item.region};
      in.insert(in.end(), item.others.begin(), item.others.end());
      for (const std::string& region : in) {
        init_ += " (in " + item.name + " " + region + ")";
        ++held[region];
      }
      for (const auto& [name, members] : layout.groups) {
        if (std::find_first_of(members.begin(), members.end(), in.begin(), in.end()) != members.end())
          init_ += " (in " + item.name + " " + name + ")";
      }
    }
    if (layout.overlaps()) {
      for (const RegionLayout::Place& region : layout.regions)
        init_ += " (within " + region.name + " " + region.name + ")";
      for (const auto& [inner, outer] : layout.within) init_ += " (within " + inner + " " + outer + ")";
    }
    // Regions for several objects count them down: (room r n) says that n more fit.
    for (int n = 0; most > 1 && n <= most; ++n) {
      Declare(Numbered("n", n), "count");
      if (n > 0) init_ += " (next " + Numbered("n", n - 1) + " " + Numbered("n", n) + ")";
      if (n == 1) init_ += " (last " + Numbered("n", n) + ")";
    }
    // At the end, so that all others have the same numbers with and without spots.
    for (const RegionLayout::Place& region : layout.regions) {
      if (region.closed) Declare(region.name, "region");
    }
    for (const RegionLayout::Place& region : layout.regions) {
      const int left = region.closed ? 0 : std::max(0, region.capacity - held[region.name]);
      if (left > 0) init_ += " (free " + region.name + ")";
      if (region.capacity > 1) init_ += " (room " + region.name + " " + Numbered("n", left) + ")";
    }
  }

  void Declare(const std::string& name, const std::string& type) { objects_ += " " + name + " - " + type; }
  void Add(const std::string& fact) { init_ += " " + fact; }
  std::string Text(const std::string& domain) const {
    return "(define (problem scene) (:domain " + domain + ")\n(:objects" + objects_ + ")\n(:init " +
           (holds_.empty() ? "(handempty)" : "(inhand " + holds_ + ")") + init_ + ")\n(:goal (and)))\n";
  }

 private:
  const RegionLayout& layout_;
  std::string objects_, init_;
  std::string holds_;  ///< The item in the hand; empty: none.
};

}  // namespace

const std::string& RegionDomainText() {
  static const std::string text = R"((define (domain regions)
  (:requirements :adl)
  (:types hub region group item count)
  (:predicates
    (at ?p - (either hub region))             ; where the hand is
    (in ?o - item ?a - (either region group)) ; placed in a region, and so in the groups that this belongs to
    (inhand ?o - item)
    (handempty)
    (free ?r - region)                        ; one more object may be placed there
    (limited ?r - region)                     ; it has a capacity
    (member ?r - region ?g - group)
    (room ?r - region ?n - count)             ; where several objects fit: n more do
    (next ?n ?m - count)                      ; m is n + 1
    (last ?n - count))                        ; n is 1
  (:action move
    :parameters (?to - (either hub region))
    :precondition (and (handempty) (exists (?h - hub)
      (or (and (= ?to ?h) (not (at ?h))) (and (not (= ?to ?h)) (at ?h)))))
    :effect (and (forall (?p - (either hub region)) (not (at ?p))) (at ?to)))
  (:action hold
    :parameters (?o - item ?to - (either hub region))
    :precondition (and (inhand ?o) (exists (?h - hub)
      (or (and (= ?to ?h) (not (at ?h))) (and (not (= ?to ?h)) (at ?h)))))
    :effect (and (forall (?p - (either hub region)) (not (at ?p))) (at ?to)))
  (:action grasp
    :parameters (?o - item ?r - region)
    :precondition (and (handempty) (at ?r) (in ?o ?r))
    :effect (and (not (handempty)) (inhand ?o) (not (in ?o ?r))
      (forall (?g - group) (when (member ?r ?g) (not (in ?o ?g))))
      (when (limited ?r) (free ?r))
      (forall (?n ?m - count)
        (when (and (next ?n ?m) (room ?r ?n)) (and (not (room ?r ?n)) (room ?r ?m))))))
  (:action place
    :parameters (?o - item ?r - region)
    :precondition (and (inhand ?o) (at ?r) (or (not (limited ?r)) (free ?r)))
    :effect (and (not (inhand ?o)) (handempty) (in ?o ?r)
      (forall (?g - group) (when (member ?r ?g) (in ?o ?g)))
      (when (and (limited ?r) (forall (?n - count) (or (last ?n) (not (room ?r ?n))))) (not (free ?r)))
      (forall (?n ?m - count)
        (when (and (next ?n ?m) (room ?r ?m)) (and (not (room ?r ?m)) (room ?r ?n)))))))
)";
  return text;
}

const std::string& OverlappingDomainText() {
  static const std::string text = [] {
    std::string all = RegionDomainText();
    all.replace(all.find("(last ?n - count))"), 18, "(last ?n - count)\n    (within ?r ?q - region))");
    return all.substr(0, all.find("  (:action grasp")) + R"(  (:action grasp
    :parameters (?o - item ?r - region)
    :precondition (and (handempty) (at ?r) (in ?o ?r))
    :effect (and (not (handempty)) (inhand ?o)
      (forall (?q - region) (when (in ?o ?q) (not (in ?o ?q))))
      (forall (?q - region) (when (and (in ?o ?q) (limited ?q)) (free ?q)))
      (forall (?g - group) (when (in ?o ?g) (not (in ?o ?g))))
      (forall (?q - region ?n ?m - count) (when (and (in ?o ?q) (next ?n ?m) (room ?q ?n))
        (and (not (room ?q ?n)) (room ?q ?m))))))
  (:action place
    :parameters (?o - item ?r - region)
    :precondition (and (inhand ?o) (at ?r)
      (forall (?q - region) (imply (within ?r ?q) (or (not (limited ?q)) (free ?q)))))
    :effect (and (not (inhand ?o)) (handempty)
      (forall (?q - region) (when (within ?r ?q) (in ?o ?q)))
      (forall (?q - region ?g - group) (when (and (within ?r ?q) (member ?q ?g)) (in ?o ?g)))
      (forall (?q - region) (when (and (within ?r ?q) (limited ?q)
        (forall (?n - count) (or (last ?n) (not (room ?q ?n))))) (not (free ?q))))
      (forall (?q - region ?n ?m - count) (when (and (within ?r ?q) (next ?n ?m) (room ?q ?m))
        (and (not (room ?q ?m)) (room ?q ?n)))))))
)";
  }();
  return text;
}

bool RegionLayout::overlaps() const {
  return !within.empty() ||
         std::any_of(items.begin(), items.end(), [](const Item& item) { return !item.others.empty(); });
}

std::string RegionProblemText(const RegionLayout& layout) { return ProblemWriter(layout).Text("regions"); }

const std::string& PoseDomainText() {
  static const std::string text = R"((define (domain poses)
  (:requirements :adl)
  (:types hub pose region group item count)
  (:predicates
    (at ?p - (either hub pose)) (in ?o - item ?a - (either pose region group)) (inhand ?o - item) (handempty)
    (of ?p - pose ?r - region)                ; the pose is in the region
    (free ?r - region) (limited ?r - region) (member ?r - region ?g - group)
    (room ?r - region ?n - count) (next ?n ?m - count) (last ?n - count)
    (taken ?p - pose))
  (:action move
    :parameters (?to - (either hub pose))
    :precondition (and (handempty) (exists (?h - hub)
      (or (and (= ?to ?h) (not (at ?h))) (and (not (= ?to ?h)) (at ?h)))))
    :effect (and (forall (?p - (either hub pose)) (not (at ?p))) (at ?to)))
  (:action hold
    :parameters (?o - item ?to - (either hub pose))
    :precondition (and (inhand ?o) (exists (?h - hub)
      (or (and (= ?to ?h) (not (at ?h))) (and (not (= ?to ?h)) (at ?h)))))
    :effect (and (forall (?p - (either hub pose)) (not (at ?p))) (at ?to)))
  (:action grasp
    :parameters (?o - item ?p - pose)
    :precondition (and (handempty) (at ?p) (in ?o ?p))
    :effect (and (not (handempty)) (inhand ?o) (not (in ?o ?p)) (not (taken ?p))
      (forall (?r - region) (when (of ?p ?r) (not (in ?o ?r))))
      (forall (?r - region ?g - group) (when (and (of ?p ?r) (member ?r ?g)) (not (in ?o ?g))))
      (forall (?r - region) (when (and (of ?p ?r) (limited ?r)) (free ?r)))
      (forall (?r - region ?n ?m - count) (when (and (of ?p ?r) (next ?n ?m) (room ?r ?n))
        (and (not (room ?r ?n)) (room ?r ?m))))))
  (:action place
    :parameters (?o - item ?p - pose)
    :precondition (and (inhand ?o) (at ?p) (not (taken ?p))
      (exists (?r - region) (and (of ?p ?r) (or (not (limited ?r)) (free ?r)))))
    :effect (and (not (inhand ?o)) (handempty) (in ?o ?p) (taken ?p)
      (forall (?r - region) (when (of ?p ?r) (in ?o ?r)))
      (forall (?r - region ?g - group) (when (and (of ?p ?r) (member ?r ?g)) (in ?o ?g)))
      (forall (?r - region) (when (and (of ?p ?r) (limited ?r)
        (forall (?n - count) (or (last ?n) (not (room ?r ?n))))) (not (free ?r))))
      (forall (?r - region ?n ?m - count) (when (and (of ?p ?r) (next ?n ?m) (room ?r ?m))
        (and (not (room ?r ?m)) (room ?r ?n)))))))
)";
  return text;
}

std::string PoseProblemText(const RegionLayout& layout, int poses) {
  ProblemWriter writer(layout);
  for (const RegionLayout::Place& region : layout.regions) {
    for (int k = 1; k <= poses; ++k) {
      writer.Declare(Numbered(region.name, k), "pose");
      writer.Add("(of " + Numbered(region.name, k) + " " + region.name + ")");
    }
  }
  std::map<std::string, int> held;
  for (const RegionLayout::Item& item : layout.items) {
    const std::string pose = Numbered(item.region, ++held[item.region]);
    writer.Add("(in " + item.name + " " + pose + ") (taken " + pose + ")");
  }
  return writer.Text("poses");
}

RegionLayout FindLayout(const scene::Scene& scene, const std::map<std::string, Location>& where,
                        const Location& task, Diagnostics& diagnostics) {
  return LayoutFinder(scene, where, task, diagnostics).Find();
}

namespace {

std::shared_ptr<const symbolic::Problem> ParseLayout(const RegionLayout& layout) {
  return symbolic::ParseProblem(
      RegionProblemText(layout), "the scene's regions",
      symbolic::ParseDomain(layout.overlaps() ? OverlappingDomainText() : RegionDomainText(),
                            "the domain of regions"));
}

}  // namespace

std::shared_ptr<const symbolic::Problem> MakeRegionProblem(const scene::Scene& scene,
                                                           const std::map<std::string, Location>& where,
                                                           const Location& task, Diagnostics& diagnostics) {
  Diagnostics mistakes;
  const RegionLayout layout = FindLayout(scene, where, task, mistakes);
  for (const Diagnostic& mistake : mistakes.list())
    diagnostics.Add(mistake.where, mistake.message, mistake.accepted);
  return mistakes.empty() ? ParseLayout(layout) : nullptr;
}

std::shared_ptr<const symbolic::Problem> MakeRegionProblem(const scene::Scene& scene,
                                                           const RegionState& state) {
  Diagnostics mistakes;
  const RegionLayout layout = LayoutFinder(scene, {}, {}, mistakes).Find(state);
  mistakes.ThrowIfAny();
  return ParseLayout(layout);
}

scene::Scene WithSpots(const scene::Scene& scene) {
  scene::Scene with = scene;
  const std::map<std::string, math::Pose> X_WO = scene::InitialPoses(scene);
  for (const scene::Object& object : scene.objects) {
    if (!object.movable()) continue;
    const math::Pose& X = X_WO.at(object.name);
    scene::Region spot;
    spot.name = SpotOf(object.name);
    // So small that nothing is ever in it.
    spot.form = scene::Disc{1e-3};
    spot.parent = object.name;
    spot.X_ParentRegion.R = X.R.transpose();
    const double lowest = geometry::BoundingBox(object.shape, X).lower.z();
    spot.X_ParentRegion.p = X.R.transpose() * Eigen::Vector3d(0, 0, lowest - X.p.z());
    spot.capacity = 1;
    with.regions.push_back(std::move(spot));
  }
  return with;
}

}  // namespace tether::planning
