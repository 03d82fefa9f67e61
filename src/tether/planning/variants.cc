#include "tether/planning/variants.h"

namespace tether::planning {

VariantQueue::VariantQueue(int limit) : limit_(limit) {
  queue_.insert({0, inserted_++, {}});
  seen_.insert(Variant{});
}

std::optional<Variant> VariantQueue::Next() {
  if (queue_.empty() || yielded_ >= limit_) return std::nullopt;
  ++yielded_;
  return queue_.extract(queue_.begin()).value().variant;
}

void VariantQueue::Expand(const Variant& variant, const std::vector<ChoicePoint>& choices) {
  for (const ChoicePoint& choice : choices) {
    const int next = choice.chosen + 1;
    if (next >= static_cast<int>(choice.options.size())) continue;
    Variant neighbour = variant;
    neighbour[choice.key] = next;
    if (!seen_.insert(neighbour).second) continue;
    double score = 0;
    for (const ChoicePoint& other : choices) {
      const int option = other.key == choice.key ? next : other.chosen;
      score += other.options[static_cast<size_t>(option)].score - other.options.front().score;
    }
    queue_.insert({score, inserted_++, std::move(neighbour)});
  }
}

}  // namespace tether::planning
