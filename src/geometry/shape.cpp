// SPDX-License-Identifier: BSD-3-Clause
#include "dyop/geometry/shape.h"

#include <ostream>

namespace dyop {

std::string_view name_of(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::Vertex:
      return "Vertex";
    case FeatureKind::Edge:
      return "Edge";
    case FeatureKind::Face:
      return "Face";
    case FeatureKind::Smooth:
      return "Smooth";
  }
  return "Smooth";
}

std::ostream& operator<<(std::ostream& out, FeatureKind kind) {
  return out << name_of(kind);
}

}  // namespace dyop
