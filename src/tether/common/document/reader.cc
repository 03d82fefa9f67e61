#include "tether/common/document/reader.h"

#include <algorithm>
#include <cmath>

#include "tether/common/bounds.h"

namespace tether {
namespace {

std::string Shown(const Value& value) {
  return value.is_scalar() ? "'" + value.AsText() + "'" : value.KindName();
}

bool IsFinite(const Value& value) {
  return value.kind() == Value::Kind::kNumber && std::isfinite(value.number());
}

}  // namespace

ObjectReader::ObjectReader(const Value& value, std::string what, Diagnostics& diagnostics)
    : value_(value), what_(std::move(what)), diagnostics_(diagnostics) {
  if (!value_.is_object()) {
    diagnostics_.Add(value_.where(), what_ + " is " + Shown(value_), "a map with keys is accepted");
  }
}

const Value* ObjectReader::Optional(std::string_view key) {
  known_.emplace_back(key);
  return value_.Find(key);
}

const Value* ObjectReader::Required(std::string_view key, std::string_view accepted) {
  const Value* member = Optional(key);
  if (member == nullptr && value_.is_object()) {
    diagnostics_.Add(value_.where(), what_ + " lacks '" + std::string(key) + "'", std::string(accepted));
  }
  return member;
}

double ObjectReader::Number(std::string_view key, double fallback) {
  const Value* member = Optional(key);
  return member ? ReadNumber(*member, "'" + std::string(key) + "' of " + what_, diagnostics_, fallback)
                : fallback;
}

int ObjectReader::Integer(std::string_view key, int fallback) {
  const Value* member = Optional(key);
  return member ? ReadInteger(*member, "'" + std::string(key) + "' of " + what_, diagnostics_, fallback)
                : fallback;
}

uint64_t ObjectReader::Natural(std::string_view key, uint64_t fallback) {
  const Value* member = Optional(key);
  return member ? ReadNatural(*member, "'" + std::string(key) + "' of " + what_, diagnostics_, fallback)
                : fallback;
}

bool ObjectReader::Bool(std::string_view key, bool fallback) {
  const Value* member = Optional(key);
  return member ? ReadBool(*member, "'" + std::string(key) + "' of " + what_, diagnostics_, fallback)
                : fallback;
}

std::string ObjectReader::Text(std::string_view key, std::string fallback) {
  const Value* member = Optional(key);
  if (member == nullptr) return fallback;
  if (member->is_scalar() && member->AsText().empty()) return "";
  return ReadText(*member, "'" + std::string(key) + "' of " + what_, diagnostics_);
}

Eigen::VectorXd ObjectReader::Vector(std::string_view key, const Eigen::VectorXd& fallback) {
  const Value* member = Optional(key);
  if (member == nullptr) return fallback;
  return ReadVector(*member, static_cast<int>(fallback.size()), "'" + std::string(key) + "' of " + what_,
                    diagnostics_)
      .value_or(fallback);
}

std::vector<std::string> ObjectReader::TextList(std::string_view key) {
  std::vector<std::string> words;
  const Value* member = Optional(key);
  if (member == nullptr) return words;
  const std::string what = "'" + std::string(key) + "' of " + what_;
  if (!member->is_array()) {
    diagnostics_.Add(member->where(), what + " is " + Shown(*member), "a list of names is accepted");
    return words;
  }
  for (const Value& item : member->items()) words.push_back(ReadText(item, what, diagnostics_));
  return words;
}

void ObjectReader::Finish() {
  for (const Value::Member& member : value_.members()) {
    if (std::find(known_.begin(), known_.end(), member.key) != known_.end()) continue;
    const std::string nearest = NearestMatch(member.key, known_);
    std::vector<std::string> sorted = known_;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    diagnostics_.Add(member.where, "unknown key '" + member.key + "' in " + what_,
                     (nearest.empty() ? "" : "did you mean '" + nearest + "'? ") +
                         "accepted: " + JoinAlternatives(sorted));
  }
}

double ReadNumber(const Value& value, const std::string& what, Diagnostics& diagnostics, double fallback) {
  const bool finite = IsFinite(value);
  if (finite && std::abs(value.number()) <= kGreatestNumber) return value.number();
  diagnostics.Add(value.where(), what + " is " + Shown(value),
                  finite ? "a number from -1e9 to 1e9 is accepted" : "a finite number is accepted");
  return fallback;
}

double ReadPositive(const Value& value, const std::string& what, Diagnostics& diagnostics, double fallback) {
  const bool above_zero = IsFinite(value) && value.number() > 0;
  if (above_zero && value.number() >= kSmallestPositive && value.number() <= kGreatestNumber)
    return value.number();
  diagnostics.Add(
      value.where(), what + " is " + Shown(value),
      above_zero ? "a number from 1e-9 to 1e9 is accepted" : "a finite number above zero is accepted");
  return fallback;
}

double ReadLength(const Value& value, const std::string& what, Diagnostics& diagnostics, double fallback) {
  const bool above_zero = IsFinite(value) && value.number() > 0;
  if (above_zero && value.number() >= kSmallestLength && value.number() <= kGreatestLength)
    return value.number();
  diagnostics.Add(
      value.where(), what + " is " + Shown(value),
      above_zero ? "a length from 0.1 mm to 10 km is accepted" : "a finite number above zero is accepted");
  return fallback;
}

int ReadInteger(const Value& value, const std::string& what, Diagnostics& diagnostics, int fallback) {
  constexpr int64_t kMost = 2147483647;
  if (value.is_integer() && value.integer() >= -kMost && value.integer() <= kMost)
    return static_cast<int>(value.integer());
  const bool whole = value.is_integer() || value.natural();
  diagnostics.Add(
      value.where(), what + " is " + Shown(value),
      whole ? "a whole number from -2147483647 to 2147483647 is accepted" : "a whole number is accepted");
  return fallback;
}

uint64_t ReadNatural(const Value& value, const std::string& what, Diagnostics& diagnostics,
                     uint64_t fallback) {
  if (const auto natural = value.natural()) return *natural;
  diagnostics.Add(value.where(), what + " is " + Shown(value),
                  "a whole number from 0 to 18446744073709551615 is accepted");
  return fallback;
}

bool ReadBool(const Value& value, const std::string& what, Diagnostics& diagnostics, bool fallback) {
  if (value.kind() == Value::Kind::kBool) return value.boolean();
  diagnostics.Add(value.where(), what + " is " + Shown(value), "true or false is accepted");
  return fallback;
}

std::string ReadText(const Value& value, const std::string& what, Diagnostics& diagnostics) {
  if (!value.is_scalar()) {
    diagnostics.Add(value.where(), what + " is " + Shown(value), "text is accepted");
    return "";
  }
  std::string text = value.AsText();
  if (text.empty()) diagnostics.Add(value.where(), what + " is empty", "text is accepted");
  return text;
}

std::optional<Eigen::VectorXd> ReadVector(const Value& value, int size, const std::string& what,
                                          Diagnostics& diagnostics) {
  const std::string accepted = size < 0 ? "a list of finite numbers is accepted"
                                        : "a list of " + std::to_string(size) + " finite numbers is accepted";
  if (!value.is_array() || (size >= 0 && static_cast<int>(value.items().size()) != size)) {
    diagnostics.Add(
        value.where(),
        what + " is " +
            (value.is_array() ? "a list of " + std::to_string(value.items().size()) : Shown(value)),
        accepted);
    return std::nullopt;
  }
  Eigen::VectorXd vector(value.items().size());
  for (size_t i = 0; i < value.items().size(); ++i) {
    const Value& item = value.items()[i];
    const bool finite = IsFinite(item);
    if (!finite || std::abs(item.number()) > kGreatestLength) {
      diagnostics.Add(item.where(), what + " has the entry " + Shown(item),
                      finite ? "numbers from -10000 to 10000 (m or rad) are accepted" : accepted);
      return std::nullopt;
    }
    vector[static_cast<Eigen::Index>(i)] = item.number();
  }
  return vector;
}

}  // namespace tether
