// SPDX-License-Identifier: BSD-3-Clause
#include "support/oracles/proxy_oracle.h"

#include <algorithm>

#include "support/oracles/fast_distance_oracle.h"

namespace dyop::testing {
namespace {

class Sampler {
 public:
  Sampler(const TriangleMesh& tool, const ToolSpan& tool_span,
          const std::vector<TriangleIndices>& tissue, const TissueSpan& tissue_span, Scalar wanted,
          Scalar resolution)
      : body_(tool),
        tool_span_(tool_span),
        tissue_(tissue),
        tissue_span_(tissue_span),
        wanted_(wanted),
        resolution_(resolution) {
    for (std::size_t k = 0; k < tissue_span.start.size(); ++k) {
      tissue_way_ = std::max(tissue_way_, (tissue_span.end[k] - tissue_span.start[k]).norm());
    }
    // A point at r from the tool's origin goes at most as far as the origin and its arc.
    const Matrix3 turn = tool_span.X_WT1.rotation() * tool_span.X_WT0.rotation().transpose();
    tool_way_ = (tool_span.X_WT1.translation() - tool_span.X_WT0.translation()).norm() +
                rotation_vector(turn).norm() * body_.radius();
  }

  Scalar distance_at(Scalar s) {
    const TriangleMesh mesh(tissue_span_.at(s), tissue_);
    const OracleBody tissue(mesh);
    PairSeed seed;
    const Scalar distance = fast_oracle_distance(body_, tool_span_.at(s), tissue, RigidPose(),
                                                 {resolution_ / 8, 0, 0}, seed)
                                .lower;
    result.least = std::min(result.least, distance);
    ++result.samples;
    return distance;
  }

  void sample(Scalar s0, Scalar d0, Scalar s1, Scalar d1) {
    const Scalar way = (s1 - s0) * (tissue_way_ + tool_way_);
    const Scalar proven = (d0 + d1 - way) / 2;
    if (proven >= wanted_ || way <= resolution_) {
      result.proven = std::min(result.proven, proven);
      return;
    }
    const Scalar s = (s0 + s1) / 2;
    const Scalar d = distance_at(s);
    sample(s0, d0, s, d);
    sample(s, d, s1, d1);
  }

  SampledDistance result;

 private:
  const OracleBody body_;
  const ToolSpan& tool_span_;
  const std::vector<TriangleIndices>& tissue_;
  const TissueSpan& tissue_span_;
  const Scalar wanted_;
  const Scalar resolution_;
  Scalar tissue_way_ = 0;
  Scalar tool_way_ = 0;
};

}  // namespace

RigidPose ToolSpan::at(Scalar s) const {
  const Vector3 w = rotation_vector(X_WT1.rotation() * X_WT0.rotation().transpose());
  return RigidPose(Matrix3(rotation_from_vector(s * w) * X_WT0.rotation()),
                   X_WT0.translation() + s * (X_WT1.translation() - X_WT0.translation()));
}

std::vector<Vector3> TissueSpan::at(Scalar s) const {
  std::vector<Vector3> vertices(start.size());
  for (std::size_t k = 0; k < start.size(); ++k) vertices[k] = start[k] + s * (end[k] - start[k]);
  return vertices;
}

SampledDistance sample_distance(const TriangleMesh& tool, const ToolSpan& tool_span,
                                const std::vector<TriangleIndices>& tissue,
                                const TissueSpan& tissue_span, Scalar wanted, Scalar resolution) {
  Sampler sampler(tool, tool_span, tissue, tissue_span, wanted, resolution);
  const Scalar start = sampler.distance_at(0);
  const Scalar end = sampler.distance_at(1);
  sampler.sample(0, start, 1, end);
  return sampler.result;
}

}  // namespace dyop::testing
