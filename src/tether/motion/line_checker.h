#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include <Eigen/Core>

namespace tether::motion {

/// Answers whether configurations (n, rad), and straight lines between them, are free.
class LineChecker {
 public:
  virtual ~LineChecker() = default;
  virtual bool IsFree(const Eigen::VectorXd& q) = 0;
  virtual bool IsFree(const Eigen::VectorXd& a, const Eigen::VectorXd& b) = 0;
  /// Configurations that were looked at so far: in all, and by exact distances.
  virtual int64_t checks() const = 0;
  virtual int64_t exact_checks() const { return checks(); }
  /// What forbids a configuration that is not free.
  virtual std::string Why(const Eigen::VectorXd& q) const = 0;
};

/// Asks a predicate at samples, for what has no bound on how it changes in between.
class SampledChecker final : public LineChecker {
 public:
  /// `resolution`: the most that a joint moves between two samples, rad.
  SampledChecker(std::function<bool(const Eigen::VectorXd&)> is_free, double resolution)
      : is_free_(std::move(is_free)), resolution_(resolution) {}

  bool IsFree(const Eigen::VectorXd& q) override;
  bool IsFree(const Eigen::VectorXd& a, const Eigen::VectorXd& b) override;
  int64_t checks() const override { return checks_; }
  std::string Why(const Eigen::VectorXd& q) const override;

 private:
  std::function<bool(const Eigen::VectorXd&)> is_free_;
  double resolution_;
  int64_t checks_ = 0;
};

}  // namespace tether::motion
