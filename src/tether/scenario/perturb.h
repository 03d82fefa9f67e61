#pragma once

#include <cstdint>

#include "tether/scenario/scenario.h"

namespace tether::scenario {

/// The scene with the initial poses of its movable objects displaced: horizontally, uniformly within a disc
/// of radius `perturb.position`, and by a yaw about their own vertical, uniform within ± `perturb.rotation`.
/// What stands on a movable object moves with it, and its own displacement is relative to it. Heights and
/// tilts stay, so that everything still rests on what it rested on; a draw by which an object would leave its
/// support or run into another one is drawn again. Each object has its own generator, so the same seed gives
/// the same scene.
scene::Scene PerturbScene(const scene::Scene& scene, const Perturbation& perturb, uint64_t seed);

}  // namespace tether::scenario
