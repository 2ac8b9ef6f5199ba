// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "dyop/motion/user_motion.h"
#include "python/glue/callback.h"

namespace dyop::python {

/// A UserMotion that knows its Python functions, so that it can be pickled.
class PythonMotion final : public Motion {
 public:
  /// pose, twist, twist_bound, smooth_until (or None).
  using Functions = std::array<SharedObject, 4>;

  PythonMotion(const Functions& functions, const TimeInterval& domain)
      : functions_(functions), motion_(make(functions), domain) {}

  RigidPose pose(Scalar t) const override { return motion_.pose(t); }
  Twist twist(Scalar t) const override { return motion_.twist(t); }
  TwistBound twist_bound(const TimeInterval& interval) const override {
    return motion_.twist_bound(interval);
  }
  TimeInterval domain() const override { return motion_.domain(); }
  Scalar smooth_until(Scalar t) const override { return motion_.smooth_until(t); }

  const Functions& functions() const { return functions_; }

 private:
  // A TwistBound or four numbers.
  static TwistBound read_bound(const py::object& value) {
    if (py::isinstance<TwistBound>(value)) return value.cast<TwistBound>();
    const auto numbers = read_as<std::array<Scalar, 4>>(
        value, "twist_bound must return a TwistBound or four numbers");
    return {numbers[0], numbers[1], numbers[2], numbers[3]};
  }
  static UserMotion::Functions make(const Functions& functions) {
    UserMotion::Functions made;
    made.pose = PoseFunction{functions[0]};
    made.twist = TwistFunction{functions[1]};
    made.twist_bound = PythonFunction<&read_bound>{functions[2]};
    if (!functions[3].get().is_none()) made.smooth_until = ScalarFunction{functions[3]};
    return made;
  }

  Functions functions_;
  UserMotion motion_;
};

}  // namespace dyop::python
