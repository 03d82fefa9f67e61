#pragma once

#include <vector>

#include "tether/geometry/shape.h"

struct mjModel_;

namespace tether::sim {

/// Whether a solid can roll: all of its parts are round about one and the same axis.
bool Rolls(const geometry::Shape& shape);

/// Makes the contacts of geoms resist rolling: `rolls` has a value per geom of the model. Priorities have to
/// be set before.
void SetRollingFriction(mjModel_* model, const std::vector<bool>& rolls);

}  // namespace tether::sim
