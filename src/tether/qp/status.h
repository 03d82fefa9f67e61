#pragma once

#include <string>

namespace tether::qp {

enum class Status {
  kNotSolved,       ///< Not called yet.
  kSolved,          ///< Optimal to rounding.
  kInfeasible,      ///< No point satisfies all constraints; conflict() proves it.
  kIterationLimit,  ///< Gave up.
  kBadInput,        ///< A number is NaN or out of place, or H is not positive definite.
};

std::string ToString(Status status);

}  // namespace tether::qp
