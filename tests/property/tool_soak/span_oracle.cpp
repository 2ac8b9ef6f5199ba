// SPDX-License-Identifier: BSD-3-Clause
#include "span_oracle.h"

#include <algorithm>
#include <cmath>

#include "dyop/geometry/triangle_mesh.h"
#include "plain_distance.h"

namespace dyop::testing {
ToolSpanPath::ToolSpanPath(const ToolPose& from, const ToolPose& to) : from_(from), to_(to) {
  const Eigen::AngleAxis<Scalar> turn(
      Matrix3(to.X_WT.rotation() * from.X_WT.rotation().transpose()));
  shift_ = to.X_WT.translation() - from.X_WT.translation();
  axis_ = turn.axis();
  angle_ = turn.angle();
  turn_ = std::abs(angle_);
  Scalar hinge_turn = 0;
  for (std::size_t k = 0; k < kMostHinges; ++k) {
    hinge_turn = std::max(hinge_turn, std::abs(to.angles[k] - from.angles[k]));
  }
  turn_ += hinge_turn;
}

ToolPose ToolSpanPath::at(Scalar s) const {
  const Matrix3 turn = Eigen::AngleAxis<Scalar>(s * angle_, axis_).toRotationMatrix();
  ToolPose pose = from_;
  pose.X_WT =
      RigidPose(Matrix3(turn * from_.X_WT.rotation()), from_.X_WT.translation() + s * shift_);
  for (std::size_t k = 0; k < kMostHinges; ++k) {
    pose.angles[k] += s * (to_.angles[k] - from_.angles[k]);
  }
  return pose;
}

std::vector<SpanBody> span_bodies(const HapticTool& tool) {
  std::vector<SpanBody> bodies;
  for (const ToolPart& given : tool.parts) {
    const auto& mesh = static_cast<const TriangleMesh&>(*given.shape);
    SpanBody& body = bodies.emplace_back();
    body.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
    RigidPose X = given.X_TP;
    Scalar offset = 0;
    if (given.hinge) {
      body.hinge = *given.hinge;
      body.X_TJ = tool.hinges[body.hinge].X_TJ;
      X = body.X_TJ->inverse() * given.X_TP;
      offset = body.X_TJ->translation().norm();
    }
    for (const Vector3& p : mesh.vertices()) {
      body.vertices.push_back(X * p);
      body.reach = std::max(body.reach, body.vertices.back().norm() + offset);
    }
  }
  return bodies;
}

RigidPose SpanBody::pose(const ToolPose& tool) const {
  if (!X_TJ) return tool.X_WT;
  const Matrix3 turn =
      Eigen::AngleAxis<Scalar>(tool.angles[hinge], Vector3::UnitZ()).toRotationMatrix();
  return tool.X_WT * *X_TJ * RigidPose(turn, Vector3::Zero());
}

void SpanOracle::find_pairs(const SpanBody& part, const SpanPart& span, const TissuePath& tissue,
                            Scalar cap) {
  const RigidPose X0 = part.pose(span.path.at(span.s0)), X1 = part.pose(span.path.at(span.s1));
  const Scalar wider = cap + span.path.bow(part.reach, span.s1 - span.s0);
  const Vector3 border = Vector3::Constant(wider);
  AlignedBox whole;
  boxes_.assign(part.triangles.size(), AlignedBox());
  for (std::size_t k = 0; k < part.triangles.size(); ++k) {
    for (const std::int32_t i : part.triangles[k]) {
      const Vector3& p = part.vertices[std::size_t(i)];
      boxes_[k].extend(X0 * p).extend(X1 * p);
    }
    boxes_[k] = AlignedBox(boxes_[k].min() - border, boxes_[k].max() + border);
    whole.extend(boxes_[k]);
  }
  pairs_.clear();
  tissue.find_near(whole, near_);
  if (near_.empty()) return;
  std::vector<AlignedBox> near_boxes;
  AlignedBox near_whole;
  for (const std::size_t number : near_) {
    AlignedBox& box = near_boxes.emplace_back();
    for (const Scalar later : {span.later, span.later + span.time}) {
      for (const Vector3& p : tissue.triangle(number, later)) box.extend(p);
    }
    near_whole.extend(box);
  }
  for (std::size_t k = 0; k < boxes_.size(); ++k) {
    if (!boxes_[k].intersects(near_whole)) continue;
    for (std::size_t i = 0; i < near_.size(); ++i) {
      if (boxes_[k].intersects(near_boxes[i])) pairs_.push_back({k, near_[i], -kInfinity, 0});
    }
  }
}

// What moved since a pair was measured is subtracted; most need not be measured again.
Scalar SpanOracle::distance_at(Scalar s) {
  ++result_.samples;
  const RigidPose X = part_->pose(span_->path.at(span_->s0 + s * (span_->s1 - span_->s0)));
  Scalar least = cap_;
  for (Pair& pair : pairs_) {
    if (pair.distance - std::abs(s - pair.s) * travel_ >= least) continue;
    Triangle tool;
    for (std::size_t i = 0; i < 3; ++i) {
      tool[i] = X * part_->vertices[std::size_t(part_->triangles[pair.tool][i])];
    }
    pair.distance =
        plain_distance(tool, tissue_->triangle(pair.tissue, span_->later + s * span_->time));
    pair.s = s;
    least = std::min(least, pair.distance);
  }
  result_.least = std::min(result_.least, least);
  return least;
}

void SpanOracle::sample(Scalar s0, Scalar d0, Scalar s1, Scalar d1) {
  const Scalar travel = (s1 - s0) * travel_;
  const Scalar proven = (d0 + d1 - travel) / 2;
  if (proven >= wanted_ || travel <= resolution_) {
    result_.proven = std::min(result_.proven, proven);
    return;
  }
  const Scalar s = (s0 + s1) / 2;
  const Scalar d = distance_at(s);
  sample(s0, d0, s, d);
  sample(s, d, s1, d1);
}

SpanDistance SpanOracle::check(std::size_t part, const SpanPart& span, const TissuePath& tissue,
                               Scalar cap, Scalar wanted, Scalar resolution) {
  part_ = &parts_[part];
  tissue_ = &tissue;
  wanted_ = wanted;
  resolution_ = resolution;
  const Scalar travel =
      (span.s1 - span.s0) * span.path.travel(part_->reach) + tissue.travel(span.time);
  const int count = 1 + int(travel / kLongest);
  travel_ = travel / count;
  SpanDistance whole;
  for (int k = 0; k < count; ++k) {
    const auto s_at = [&](int i) { return span.s0 + (span.s1 - span.s0) * i / count; };
    const Scalar time = span.time / count;
    const SpanDistance found =
        check_short({span.path, s_at(k), s_at(k + 1), time, span.later + k * time}, cap);
    whole.least = std::min(whole.least, found.least);
    whole.proven = std::min(whole.proven, found.proven);
    if (k == 0) whole.at_start = found.at_start;
    whole.at_end = found.at_end;
    whole.samples += found.samples;
  }
  return whole;
}

SpanDistance SpanOracle::check_short(const SpanPart& span, Scalar cap) {
  span_ = &span;
  // Then pairs that are never closer than the cap prove what is wanted.
  cap_ = std::max(cap, wanted_ + travel_);
  result_ = {};
  find_pairs(*part_, span, *tissue_, cap_);
  if (pairs_.empty()) {
    result_.least = result_.proven = result_.at_start = result_.at_end = cap_;
    return result_;
  }
  result_.at_start = distance_at(0);
  result_.at_end = distance_at(1);
  sample(0, result_.at_start, 1, result_.at_end);
  return result_;
}

}  // namespace dyop::testing
