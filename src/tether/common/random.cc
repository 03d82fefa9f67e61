#include "tether/common/random.h"

#include <bit>
#include <cassert>
#include <cmath>
#include <numbers>

namespace tether {
namespace {

uint64_t SplitMix(uint64_t& state) {
  uint64_t z = (state += 0x9e3779b97f4a7c15u);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

}  // namespace

Random::Random(uint64_t seed) {
  for (uint64_t& word : state_) word = SplitMix(seed);
}

uint64_t Random::Next() {
  const uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::Uniform(double lower, double upper) {
  return lower + (upper - lower) * (static_cast<double>(Next() >> 11) * 0x1.0p-53);
}

int Random::Index(int count) {
  assert(count > 0);
  return static_cast<int>(Next() % static_cast<uint64_t>(count));
}

double Random::Normal() {
  const double u = 1.0 - Uniform(0, 1), v = Uniform(0, 1);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

Random Random::Split(std::string_view name) const {
  uint64_t hash = 0xcbf29ce484222325u;
  for (char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return Random(hash ^ state_[0] ^ std::rotl(state_[2], 17));
}

}  // namespace tether
