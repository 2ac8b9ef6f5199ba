// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "dyop/chain/robot.h"
#include "python/glue/arguments.h"

namespace dyop::python {

/// A KinematicChain or a Robot, whose paths are those of its free coordinates.
struct ChainArgument {
  std::shared_ptr<const KinematicChain> chain;
  std::shared_ptr<const Robot> robot;  ///< none for a chain

  JointPath expand(const JointPath& path) const { return robot ? robot->expand(path) : path; }
};

/// Coordinates (K,); throws InvalidArgument.
JointVector coordinates_of(py::handle source);

}  // namespace dyop::python

namespace pybind11::detail {

template <>
struct type_caster<dyop::JointVector> {
  PYBIND11_TYPE_CASTER(dyop::JointVector, const_name("numpy.ndarray[(K,), float64]"));
  bool load(handle source, bool convert) {
    if (!convert) return false;
    value = dyop::python::coordinates_of(source);
    return true;
  }
  static handle cast(const dyop::JointVector& q, return_value_policy, handle) {
    return array_t<double>(q.size(), q.data()).release();
  }
};

template <>
struct type_caster<dyop::python::ChainArgument> {
  PYBIND11_TYPE_CASTER(dyop::python::ChainArgument, const_name("Union[KinematicChain, Robot]"));
  bool load(handle source, bool) {
    if (isinstance<dyop::Robot>(source)) {
      value.robot = source.cast<std::shared_ptr<dyop::Robot>>();
      value.chain = value.robot->chain;
      return true;
    }
    if (!isinstance<dyop::KinematicChain>(source)) return false;
    value.chain = source.cast<std::shared_ptr<dyop::KinematicChain>>();
    return true;
  }
};

}  // namespace pybind11::detail
