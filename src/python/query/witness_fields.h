// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/distance/witness_pair.h"
#include "dyop/toi/toi_result.h"
#include "python/glue/record.h"

namespace dyop::python {

/// The fields that a record has because it is a WitnessPair.
template <typename SomeRecord>
void add_witness_fields(SomeRecord& record) {
  record.template field<&WitnessPair::lower>("lower", "float: never above the distance")
      .template field<&WitnessPair::upper>("upper", "float: never below the distance")
      .template field<&WitnessPair::p_WCa>("p_WCa", "numpy.ndarray: (3,) witness point on A")
      .template field<&WitnessPair::p_WCb>("p_WCb", "numpy.ndarray: (3,) witness point on B")
      .template field<&WitnessPair::nhat_AB_W>("nhat_AB_W",
                                               "numpy.ndarray: (3,) unit normal from A to B")
      .template field<&WitnessPair::feature_a>("feature_a", "Feature: of A")
      .template field<&WitnessPair::feature_b>("feature_b", "Feature: of B")
      .template field<&WitnessPair::triangle_a>("triangle_a",
                                                "Optional[int]: if A, or its child, is a mesh")
      .template field<&WitnessPair::triangle_b>("triangle_b",
                                                "Optional[int]: if B, or its child, is a mesh")
      .template field<&WitnessPair::child_a>("child_a", "Optional[int]: if A is a compound")
      .template field<&WitnessPair::child_b>("child_b", "Optional[int]: if B is a compound");
  record.type.def(
      "pivot_W",
      [](py::handle self) {
        const py::object sum = self.attr("p_WCa").attr("__add__")(self.attr("p_WCb"));
        return sum.attr("__truediv__")(2.0);
      },
      "Dynamic pivot point (3,): the midpoint of the witness segment.");
}

}  // namespace dyop::python
