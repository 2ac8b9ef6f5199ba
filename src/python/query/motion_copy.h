// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <type_traits>

#include "dyop/motion/bezier_motion.h"
#include "dyop/motion/composed_motion.h"
#include "dyop/motion/constant_twist_motion.h"
#include "dyop/motion/hermite_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/rest_motion.h"
#include "dyop/motion/sampled_motion.h"
#include "dyop/motion/screw_motion.h"
#include "dyop/motion/sequence_motion.h"
#include "python/query/python_motion.h"

namespace dyop::python {

using SharedMotion = std::shared_ptr<Motion>;

/// A copy that Python can own of a motion that lies within another one. Null if it is of a class of
/// somebody else's.
inline SharedMotion copy_motion(const Motion& motion) {
  SharedMotion copy;
  const auto try_class = [&]<typename T>(std::type_identity<T>) {
    const auto* found = dynamic_cast<const T*>(&motion);
    if (!copy && found != nullptr) copy = std::make_shared<T>(*found);
  };
  try_class(std::type_identity<RestMotion>());
  try_class(std::type_identity<ConstantTwistMotion>());
  try_class(std::type_identity<ScrewMotion>());
  try_class(std::type_identity<InterpolatedMotion>());
  try_class(std::type_identity<HermiteMotion>());
  try_class(std::type_identity<BezierMotion>());
  try_class(std::type_identity<SampledMotion>());
  try_class(std::type_identity<SequenceMotion>());
  try_class(std::type_identity<ComposedMotion>());
  try_class(std::type_identity<PythonMotion>());
  return copy;
}

}  // namespace dyop::python
