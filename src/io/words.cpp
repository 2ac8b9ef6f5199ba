// SPDX-License-Identifier: BSD-3-Clause
#include "io/words.h"

#include <sstream>

namespace dyop::io_internal {
namespace {

std::string feature_words(const Feature& feature) {
  std::ostringstream out;
  switch (feature.kind) {
    case FeatureKind::Vertex:
      out << "vertex";
      break;
    case FeatureKind::Edge:
      out << "edge";
      break;
    case FeatureKind::Face:
      out << "face";
      break;
    case FeatureKind::Smooth:
      return "curved surface";
  }
  for (std::size_t k = 0; k < feature.vertex_count(); ++k) out << ' ' << feature.vertices[k];
  return out.str();
}

}  // namespace

std::string show(Scalar value) {
  std::ostringstream out;
  out.precision(9);
  out << value;
  return out.str();
}

std::string show(const Vector3& v) {
  std::ostringstream out;
  out.precision(6);
  out << '(' << v.x() << ", " << v.y() << ", " << v.z() << ')';
  return out.str();
}

std::string place_words(const Vector3& p_WC, const Feature& feature,
                        const std::optional<std::int32_t>& triangle) {
  std::string words = show(p_WC) + ", " + feature_words(feature);
  if (triangle) words += ", triangle " + std::to_string(*triangle);
  return words;
}

}  // namespace dyop::io_internal
