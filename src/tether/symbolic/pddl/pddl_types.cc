#include <algorithm>
#include <string>
#include <vector>

#include "tether/symbolic/pddl/formula_parser.h"
#include "tether/symbolic/pddl/pddl_sections.h"

namespace tether::symbolic {
namespace {

std::string Quote(std::string_view text) { return "'" + std::string(text) + "'"; }

/// Reads which types there are, and then which is the one above each.
class TypeReader {
 public:
  TypeReader(Domain& domain, Diagnostics& diagnostics) : domain_(domain), diagnostics_(diagnostics) {}

  void Read(const Expression& section) {
    Declare(section);
    Resolve();
    for (size_t i = 1; i < domain_.types.size(); ++i) Choose(i);
    RefuseCircles();
  }

 private:
  struct Link {
    int type;
    std::string parent;
    Location where;
  };

  void Declare(const Expression& section) {
    std::vector<int> waiting;
    for (size_t i = 1; i < section.items.size(); ++i) {
      const Expression& item = section.items[i];
      if (!item.is_list && item.word == "-") {
        if (++i >= section.items.size()) {
          diagnostics_.Add(item.where, "'-' without a type after it");
          break;
        }
        const Expression& parent = section.items[i];
        if (parent.is_list) {
          diagnostics_.Add(parent.where, "a type has one type above it; 'either' is not supported here");
        } else {
          for (int type : waiting) links_.push_back({type, parent.word, parent.where});
        }
        waiting.clear();
        continue;
      }
      if (item.is_list || !IsName(item.word)) {
        diagnostics_.Add(item.where,
                         (item.is_list ? "a list" : Quote(item.word)) + " is not the name of a type",
                         "accepted: letters, digits, '-', '_', '.' and '@'");
        continue;
      }
      int type = domain_.FindType(item.word);
      if (type == 0) continue;  // 'object' may be listed; it is there anyhow.
      if (type > 0) {
        diagnostics_.Warn(item.where, "type " + Quote(item.word) + " is declared twice; first at " +
                                          domain_.types[type].where.ToString());
      } else {
        type = static_cast<int>(domain_.types.size());
        domain_.types.push_back({item.word, 0, item.where});
      }
      waiting.push_back(type);
    }
  }

  /// A name that stands only after a '-' is a type as well, unless it looks like a slip of the pen.
  void Resolve() {
    above_.resize(domain_.types.size());
    for (const Link& link : links_) {
      int parent = domain_.FindType(link.parent);
      if (parent < 0) {
        const std::string suggestion = Suggest(link.parent, NamesOf(domain_.types));
        if (!IsName(link.parent) || suggestion.starts_with("did you mean")) {
          diagnostics_.Add(link.where, "unknown type " + Quote(link.parent), suggestion);
          continue;
        }
        diagnostics_.Warn(link.where, "type " + Quote(link.parent) +
                                          " is not declared itself: it is taken for one below 'object'");
        parent = static_cast<int>(domain_.types.size());
        domain_.types.push_back({link.parent, 0, link.where});
        above_.emplace_back();
      }
      above_[link.type].push_back({parent, link.where});
    }
  }

  bool IsAbove(int ancestor, int type) const {
    std::vector<bool> seen(above_.size(), false);
    std::vector<int> waiting = {type};
    while (!waiting.empty()) {
      const int next = waiting.back();
      waiting.pop_back();
      if (ancestor == 0 || next == ancestor) return true;
      if (seen[next]) continue;
      seen[next] = true;
      for (const Parent& parent : above_[next]) waiting.push_back(parent.type);
    }
    return false;
  }

  /// Of several types above one, that which all the others are above.
  void Choose(size_t type) {
    const std::vector<Parent>& parents = above_[type];
    if (parents.empty()) return;
    for (const Parent& one : parents) {
      const bool lowest = std::all_of(parents.begin(), parents.end(),
                                      [&](const Parent& other) { return IsAbove(other.type, one.type); });
      if (!lowest) continue;
      domain_.types[type].parent = one.type;
      return;
    }
    diagnostics_.Add(parents.back().where,
                     "type " + Quote(domain_.types[type].name) + " is below " +
                         Quote(domain_.types[parents.front().type].name) + " and " +
                         Quote(domain_.types[parents.back().type].name),
                     "a type has one type above it, and those above that");
  }

  void RefuseCircles() {
    for (size_t i = 1; i < domain_.types.size(); ++i) {
      size_t steps = 0;
      int above = static_cast<int>(i);
      while (above > 0 && steps++ <= domain_.types.size()) above = domain_.types[above].parent;
      if (above <= 0) continue;
      diagnostics_.Add(domain_.types[i].where, "type " + Quote(domain_.types[i].name) + " is above itself");
      domain_.types[i].parent = 0;
    }
  }

  struct Parent {
    int type;
    Location where;
  };

  Domain& domain_;
  Diagnostics& diagnostics_;
  std::vector<Link> links_;
  std::vector<std::vector<Parent>> above_;  ///< By type.
};

}  // namespace

void ParseTypes(const Expression& section, Domain& domain, Diagnostics& diagnostics) {
  TypeReader(domain, diagnostics).Read(section);
}

}  // namespace tether::symbolic
