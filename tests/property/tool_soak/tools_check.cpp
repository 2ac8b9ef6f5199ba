// SPDX-License-Identifier: BSD-3-Clause
#include "tools_check.h"

#include <cmath>
#include <cstdio>

#include "plain_distance.h"

namespace dyop::testing {
namespace {

Triangle placed(const SpanBody& body, std::size_t number, const RigidPose& X) {
  Triangle triangle;
  for (std::size_t i = 0; i < 3; ++i) {
    triangle[i] = X * body.vertices[std::size_t(body.triangles[number][i])];
  }
  return triangle;
}

// Of every triangle of a part over a motion.
std::vector<AlignedBox> swept_boxes(const SpanBody& body, const ToolSpanPath& path, Scalar s0,
                                    Scalar s1, Scalar wider) {
  const RigidPose X0 = body.pose(path.at(s0)), X1 = body.pose(path.at(s1));
  const Vector3 border = Vector3::Constant(wider + path.bow(body.reach, s1 - s0));
  std::vector<AlignedBox> boxes;
  for (const TriangleIndices& corners : body.triangles) {
    AlignedBox box;
    for (const std::int32_t i : corners) {
      const Vector3& p = body.vertices[std::size_t(i)];
      box.extend(X0 * p).extend(X1 * p);
    }
    boxes.emplace_back(box.min() - border, box.max() + border);
  }
  return boxes;
}

}  // namespace

ToolsCheck::ToolsCheck(const HapticScene& scene, const HapticOptions& options)
    : margin_(scene.tool_margin), rest_offset_(options.rest_offset) {
  for (const HapticTool& tool : scene.tools()) tools_.push_back(span_bodies(tool));
}

void ToolsCheck::check(const HapticSession& session) {
  starts_.assign(tools_.size(), {});
  for (std::size_t b = 1; b < tools_.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) check_tools(session, a, b);
  }
}

void ToolsCheck::check_tools(const HapticSession& session, std::size_t a, std::size_t b) {
  const std::vector<ToolWaypoint>& of_a = session.last(a).path;
  const std::vector<ToolWaypoint>& of_b = session.last(b).path;
  Scalar at_end = kInfinity;
  for (std::size_t i = 1; i < of_a.size(); ++i) {
    const ToolSpanPath path_a(of_a[i - 1].tool, of_a[i].tool);
    const ToolSpanPath path_b(of_b[i - 1].tool, of_b[i].tool);
    at_end = kInfinity;
    for (const SpanBody& part_a : tools_[a]) {
      for (const SpanBody& part_b : tools_[b]) {
        const SpanDistance found = measure({part_a, part_b, path_a, path_b});
        findings.samples += found.samples;
        findings.near += found.samples > 0;
        at_end = std::min(at_end, found.at_end);
        judge(session.last(b), a, b, found);
      }
    }
  }
  if (of_a.size() < 2) return;
  check_clearance(session.last(b), a, at_end);
  check_clearance(session.last(a), b, at_end);
}

SpanDistance ToolsCheck::measure(const Span& span) {
  SpanDistance whole;
  const Scalar travel = span.path_a.travel(span.a.reach) + span.path_b.travel(span.b.reach);
  const int count = 1 + int(travel / kLongest);
  for (int k = 0; k < count; ++k) {
    measure_short(span, Scalar(k) / count, Scalar(k + 1) / count, whole);
  }
  return whole;
}

void ToolsCheck::measure_short(const Span& span, Scalar s0, Scalar s1, SpanDistance& whole) {
  const Scalar travel = span.path_a.travel(span.a.reach) + span.path_b.travel(span.b.reach);
  // Then pairs that are never closer than the cap prove what is wanted.
  const Scalar cap = std::max(margin_ + kLook, margin_ + kRounding + (s1 - s0) * travel);
  find_pairs(span, s0, s1, cap);
  std::array<Scalar, 2> d{cap, cap};
  if (!pairs_.empty()) {
    d = {distance_at(span, s0, travel, cap, whole), distance_at(span, s1, travel, cap, whole)};
    sample(span, {s0, s1}, d, travel, cap, whole);
  }
  if (s0 == 0) whole.at_start = d[0];
  whole.at_end = d[1];
  whole.least = std::min({whole.least, d[0], d[1]});
}

void ToolsCheck::find_pairs(const Span& span, Scalar s0, Scalar s1, Scalar cap) {
  pairs_.clear();
  const std::vector<AlignedBox> of_a = swept_boxes(span.a, span.path_a, s0, s1, cap);
  const std::vector<AlignedBox> of_b = swept_boxes(span.b, span.path_b, s0, s1, 0);
  AlignedBox whole;
  for (const AlignedBox& box : of_b) whole.extend(box);
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    if (!of_a[i].intersects(whole)) continue;
    for (std::size_t k = 0; k < of_b.size(); ++k) {
      if (of_a[i].intersects(of_b[k])) pairs_.push_back({i, k, -kInfinity, 0});
    }
  }
}

// What moved since a pair was measured is subtracted; most need not be measured again.
Scalar ToolsCheck::distance_at(const Span& span, Scalar s, Scalar travel, Scalar cap,
                               SpanDistance& whole) {
  ++whole.samples;
  const RigidPose X_WA = span.a.pose(span.path_a.at(s)), X_WB = span.b.pose(span.path_b.at(s));
  Scalar least = cap;
  for (Pair& pair : pairs_) {
    if (pair.distance - std::abs(s - pair.s) * travel >= least) continue;
    pair.distance = plain_distance(placed(span.a, pair.a, X_WA), placed(span.b, pair.b, X_WB));
    pair.s = s;
    least = std::min(least, pair.distance);
  }
  whole.least = std::min(whole.least, least);
  return least;
}

void ToolsCheck::sample(const Span& span, const std::array<Scalar, 2>& s,
                        const std::array<Scalar, 2>& d, Scalar travel, Scalar cap,
                        SpanDistance& whole) {
  const Scalar moved = (s[1] - s[0]) * travel;
  const Scalar proven = (d[0] + d[1] - moved) / 2;
  if (proven >= margin_ + kRounding || moved <= kResolution) {
    whole.proven = std::min(whole.proven, proven);
    return;
  }
  const Scalar middle = (s[0] + s[1]) / 2;
  const Scalar there = distance_at(span, middle, travel, cap, whole);
  sample(span, {s[0], middle}, {d[0], there}, travel, cap, whole);
  sample(span, {middle, s[1]}, {there, d[1]}, travel, cap, whole);
}

void ToolsCheck::judge(const HapticTick& tick, std::size_t a, std::size_t b,
                       const SpanDistance& found) {
  const Scalar start = found.at_start;
  starts_[a].add(start, margin_);
  starts_[b].add(start, margin_);
  const bool is_exempt = tick.status == HapticStatus::Recovering ||
                         tick.status == HapticStatus::Overlapping ||
                         tick.status == HapticStatus::InvalidInput;
  const bool starts_untold = start < margin_ - kRounding && !is_exempt;
  const bool comes_nearer =
      start > kRounding &&
      found.least < promised_distance(start, margin_, rest_offset_) - kRounding;
  const bool is_full = has_full_promise(start, margin_, rest_offset_);
  const bool is_unproven = start > kRounding && is_full && !(found.proven > margin_);
  if (is_full) findings.least_excess = std::min(findings.least_excess, found.least - margin_);
  findings.breaches += starts_untold || comes_nearer;
  findings.unproven += is_unproven;
  if (!starts_untold && !comes_nearer && !is_unproven) return;
  std::printf("tools %zu and %zu, status %d: from %.9g to %.9g, proven %.9g\n", a, b,
              static_cast<int>(tick.status), start, found.least, found.proven);
}

void ToolsCheck::check_clearance(const HapticTick& tick, std::size_t other, Scalar distance) {
  const ToolClearance& clearance = tick.tool_clearances[other];
  if (!(distance < margin_ + kLook)) return;
  if (clearance.lower <= distance + kRounding && clearance.upper >= distance - kRounding) return;
  ++findings.wrong_clearances;
  std::printf("distance %.9g of tool %zu is told to be between %.9g and %.9g\n", distance, other,
              clearance.lower, clearance.upper);
}

}  // namespace dyop::testing
