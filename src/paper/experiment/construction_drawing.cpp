// SPDX-License-Identifier: BSD-3-Clause
#include "paper/experiment/construction_drawing.h"

#include <algorithm>
#include <cstdio>

#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/planar_distance.h"
#include "dyop/paper/published_dyop.h"
#include "paper/experiment/paper_experiment.h"
#include "paper/experiment/svg_canvas.h"

namespace dyop::cli {
namespace {

constexpr int kDrawingWidth = 640;
constexpr int kDrawingHeight = 560;
constexpr Scalar kDrawingTop = 62;
constexpr Scalar kDrawingBottom = 74;
constexpr Scalar kDrawingSide = 40;
constexpr std::string_view kColourA = "#0072b2";
constexpr std::string_view kColourB = "#d55e00";
constexpr std::string_view kColourPivot = "#cc79a7";
constexpr std::string_view kColourFound = "#b22222";
constexpr std::string_view kColourTrue = "#009e73";

// A parallel projection of space that keeps verticals upright; in the plane it only flips the y
// axis.
Vector2 projected(const Vector2& p) {
  return {p.x(), -p.y()};
}
Vector2 projected(const Vector3& p) {
  // Seen from 35 degrees to the side and 25 above: cosines and sines.
  const Scalar right = 0.819 * p.x() - 0.574 * p.y();
  const Scalar depth = 0.574 * p.x() + 0.819 * p.y();
  return {right, -(0.906 * p.z() + 0.423 * depth)};
}

// Fits the whole drawing: the projection, then one scale for both axes.
class View {
 public:
  void include(const Vector2& p) { bounds_.extend(p); }

  template <typename Point>
  Vector2 of(const Point& p) const {
    const Vector2 space(kDrawingWidth - 2 * kDrawingSide,
                        kDrawingHeight - kDrawingTop - kDrawingBottom);
    const Scalar scale = (space.array() / bounds_.sizes().array()).minCoeff();
    const Vector2 center(kDrawingWidth / 2.0, kDrawingTop + space.y() / 2);
    return center + scale * (projected(p) - bounds_.center());
  }

 private:
  Eigen::AlignedBox2d bounds_;
};

// The corners of a box, and the pairs of them that its edges join.
template <int dimension>
std::vector<PaperPoint<dimension>> corners_of(const Eigen::AlignedBox<Scalar, dimension>& box) {
  std::vector<PaperPoint<dimension>> corners;
  for (int k = 0; k < (1 << dimension); ++k) {
    PaperPoint<dimension> corner;
    for (int axis = 0; axis < dimension; ++axis) {
      corner[axis] = (k >> axis & 1) ? box.max()[axis] : box.min()[axis];
    }
    corners.push_back(corner);
  }
  return corners;
}

template <int dimension>
void draw_box(SvgCanvas& canvas, const View& view, const Eigen::AlignedBox<Scalar, dimension>& box,
              const SvgStyle& style) {
  const auto corners = corners_of(box);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    for (int axis = 0; axis < dimension; ++axis) {
      const std::size_t other = k | (std::size_t{1} << axis);
      if (other != k) canvas.line(view.of(corners[k]), view.of(corners[other]), style);
    }
  }
}

template <int dimension>
void draw_triangle(SvgCanvas& canvas, const View& view, const PaperTriangle<dimension>& triangle,
                   const std::array<int, 2>& kept, std::string_view colour,
                   const std::string& name) {
  canvas.polygon({view.of(triangle[0]), view.of(triangle[1]), view.of(triangle[2])},
                 {.fill = colour, .stroke = colour, .stroke_width = 1.5, .opacity = 0.35});
  for (int k = 0; k < 3; ++k) {
    const bool is_kept = k == kept[0] || k == kept[1];
    canvas.circle(view.of(triangle[static_cast<std::size_t>(k)]), is_kept ? 5 : 3.5,
                  {.fill = is_kept ? colour : "#ffffff", .stroke = colour, .stroke_width = 1.5});
  }
  canvas.line(view.of(triangle[static_cast<std::size_t>(kept[0])]),
              view.of(triangle[static_cast<std::size_t>(kept[1])]),
              {.stroke = colour, .stroke_width = 3});
  const PaperPoint<dimension> middle = (triangle[0] + triangle[1] + triangle[2]) / 3;
  canvas.text(view.of(middle) + Vector2(0, 4), name, 13, SvgAnchor::Middle, "#222222", true);
}

struct TrueSegment {
  std::array<Vector2, 2> ends;
  Scalar length;
};

template <int dimension>
TrueSegment true_segment(const View& view, const PaperPair<dimension>& pair) {
  if constexpr (dimension == 2) {
    const PlanarDistance d = planar_triangle_distance(pair.a, pair.b);
    return {{view.of(d.p_a), view.of(d.p_b)}, d.upper};
  } else {
    const TriangleDistance d = triangle_distance(pair.a, pair.b);
    return {{view.of(d.p_a), view.of(d.p_b)}, d.upper};
  }
}

std::string words(const char* format, Scalar value) {
  char buffer[128];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

void draw_legend(SvgCanvas& canvas, Scalar found, const TrueSegment& truth) {
  const Scalar y = kDrawingHeight - kDrawingBottom + 28;
  canvas.line({kDrawingSide, y - 4}, {kDrawingSide + 24, y - 4},
              {.stroke = kColourFound, .stroke_width = 3});
  canvas.text({kDrawingSide + 32, y}, words("shortest of the kept edges: %.6g", found));
  canvas.line({kDrawingSide + 290, y - 4}, {kDrawingSide + 314, y - 4},
              {.stroke = kColourTrue, .stroke_width = 3, .dashes = "5 3"});
  canvas.text({kDrawingSide + 322, y}, words("true distance: %.6g", truth.length));
  canvas.rectangle({kDrawingSide, y + 13}, {24, 12},
                   {.stroke = kColourPivot, .stroke_width = 1.5, .dashes = "3 2"});
  canvas.text({kDrawingSide + 32, y + 24}, "internal box, with the pivot in its middle");
  canvas.circle({kDrawingSide + 302, y + 19}, 5, {.fill = "#555555"});
  canvas.circle({kDrawingSide + 382, y + 19}, 3.5, {.fill = "#ffffff", .stroke = "#555555"});
  canvas.text({kDrawingSide + 312, y + 24}, "kept");
  canvas.text({kDrawingSide + 391, y + 24}, "dropped vertex");
}

}  // namespace

template <int dimension>
std::string draw_construction(const PaperTest<dimension>& test) {
  const PublishedDyop<dimension> dyop = published_dyop(test.pair.a, test.pair.b);
  View view;
  for (const auto* box : {&dyop.box_a, &dyop.box_b, &dyop.internal_box}) {
    for (const auto& corner : corners_of(*box)) view.include(projected(corner));
  }
  const std::string names =
      "Obj" + std::to_string(test.object) + " against Obj" + std::to_string(test.against);
  const std::string title =
      "The construction of DyOP in " + std::to_string(dimension) + "D: " + names;
  SvgCanvas canvas(kDrawingWidth, kDrawingHeight, title);
  canvas.text({kDrawingSide, 26}, title, 17, SvgAnchor::Start, "#222222", true);
  const TrueSegment truth = true_segment(view, test.pair);
  const bool is_right = dyop.distance <= truth.length + kWrongBy;
  canvas.text({kDrawingSide, 46},
              is_right ? "The pivot keeps the edges that hold the nearest points."
                       : words("The pivot keeps the wrong edges: %.3g times the true distance.",
                               dyop.distance / truth.length),
              12, SvgAnchor::Start, is_right ? "#555555" : kColourFound);
  draw_box(canvas, view, dyop.box_a, {.stroke = kColourA, .dashes = "6 4", .opacity = 0.7});
  draw_box(canvas, view, dyop.box_b, {.stroke = kColourB, .dashes = "6 4", .opacity = 0.7});
  draw_triangle<dimension>(canvas, view, test.pair.a, dyop.kept_a, kColourA,
                           "Obj" + std::to_string(test.object));
  draw_triangle<dimension>(canvas, view, test.pair.b, dyop.kept_b, kColourB,
                           "Obj" + std::to_string(test.against));
  draw_box(canvas, view, dyop.internal_box,
           {.stroke = kColourPivot, .stroke_width = 1.5, .dashes = "3 2"});
  canvas.circle(view.of(dyop.pivot), 5, {.fill = kColourPivot, .stroke = "#222222"});
  canvas.line(view.of(dyop.p_a), view.of(dyop.p_b), {.stroke = kColourFound, .stroke_width = 3});
  canvas.line(truth.ends[0], truth.ends[1],
              {.stroke = kColourTrue, .stroke_width = 3, .dashes = "5 3"});
  draw_legend(canvas, dyop.distance, truth);
  return canvas.str();
}

template std::string draw_construction<2>(const PaperTest<2>&);
template std::string draw_construction<3>(const PaperTest<3>&);

}  // namespace dyop::cli
