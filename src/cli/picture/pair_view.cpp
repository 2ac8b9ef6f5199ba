// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/pair_view.h"

#include <algorithm>
#include <cmath>

#include "dyop/io/result_text.h"

namespace dyop::cli {
namespace {

// Pixels of an image for one of the canvas.
constexpr int kSharpness = 2;
constexpr Scalar kOpacityOfStart = 0.3;
// How far the camera is raised above the horizon, radians.
constexpr Scalar kElevation = 0.32;
// A close-up shows this part of the smaller body, or so many gaps.
constexpr Scalar kPartOfBody = 0.12;
constexpr Scalar kGapsAcross = 2;

// Seen from the side of the normal, z upwards; from a little above.
Camera make_camera(const PairScene& scene) {
  const Vector3 n = scene.witness ? scene.witness->nhat_AB_W
                                  : Vector3(scene.X_WB.translation() - scene.X_WA.translation());
  Vector3 right = Vector3(n.x(), n.y(), 0);
  // literal: a normal this near the vertical has no side
  if (!(right.norm() > 0.05 * n.norm())) {
    const Vector3 way = scene.path_a.empty() || scene.path_b.empty()
                            ? Vector3::UnitX()
                            : Vector3(scene.path_b.back() - scene.path_b.front() -
                                      scene.path_a.back() + scene.path_a.front());
    right = Vector3(way.x(), way.y(), 0);
    if (!(right.norm() > 0)) right = Vector3::UnitX();
  }
  Camera camera;
  camera.right_W = right.normalized();
  const Vector3 back = camera.right_W.cross(Vector3::UnitZ());
  camera.back_W = std::cos(kElevation) * back + std::sin(kElevation) * Vector3::UnitZ();
  camera.up_W = camera.back_W.cross(camera.right_W);
  return camera;
}

// The rectangle that bodies cover, in the camera's own lengths.
class Extent {
 public:
  explicit Extent(const Camera& camera) : camera_(camera) {}
  void add(const Vector3& p_W) {
    box_.extend(Vector2(camera_.right_W.dot(p_W), camera_.up_W.dot(p_W)));
  }
  void add(const view_internal::ShapeSurface& surface, const RigidPose& X_WS) {
    for (const Vector3& v : surface.vertices) add(X_WS * v);
  }
  Vector2 size() const { return box_.sizes(); }
  Vector3 center() const {
    return box_.center().x() * camera_.right_W + box_.center().y() * camera_.up_W;
  }

 private:
  const Camera& camera_;
  Eigen::AlignedBox<Scalar, 2> box_;
};

void place(Camera& camera, const Panel& panel, const Vector3& center, Scalar scale) {
  camera.center_W = center;
  camera.width = static_cast<int>(panel.size.x()) * kSharpness;
  camera.height = static_cast<int>(panel.size.y()) * kSharpness;
  camera.pixels_per_length = scale * kSharpness;
}

void frame_all(Camera& camera, const Panel& panel, const PairScene& scene) {
  Extent now(camera);
  now.add(scene.a, scene.X_WA);
  now.add(scene.b, scene.X_WB);
  Extent all = now;
  if (scene.start) {
    all.add(scene.a, scene.start->first);
    all.add(scene.b, scene.start->second);
  }
  // What comes from very far is left out.
  constexpr Scalar kMostOfStart = 5;
  const bool shows_start = all.size().maxCoeff() <= kMostOfStart * now.size().maxCoeff();
  const Extent& shown = shows_start ? all : now;
  constexpr Scalar kFilled = 0.9;
  const Vector2 size = shown.size().cwiseMax(Vector2::Constant(scene.radius_a * 0.01));
  place(camera, panel, shown.center(),
        kFilled * std::min(panel.size.x() / size.x(), panel.size.y() / size.y()));
}

Vector2 on_canvas(const Camera& camera, const Panel& panel, const Vector3& p_W) {
  return panel.corner + camera.project(p_W) / kSharpness;
}

void draw_image(SvgCanvas& canvas, const Panel& panel, const Camera& camera,
                const PairScene& scene) {
  ShadedImage image(camera);
  image.draw(scene.a, scene.X_WA, kColourA, 1);
  image.draw(scene.b, scene.X_WB, kColourB, 1);
  if (scene.start) {
    image.draw(scene.a, scene.start->first, kColourA, kOpacityOfStart);
    image.draw(scene.b, scene.start->second, kColourB, kOpacityOfStart);
  }
  canvas.image(panel.corner, panel.size, base64(image.png()));
}

bool is_inside(const Panel& panel, const Vector2& p) {
  return (p.array() >= panel.corner.array()).all() &&
         (p.array() <= (panel.corner + panel.size).array()).all();
}

void draw_path(SvgCanvas& canvas, const Panel& panel, const Camera& camera,
               const std::vector<Vector3>& path, std::string_view ink) {
  std::vector<Vector2> run;
  const auto flush = [&] {
    if (run.size() > 1) {
      canvas.polyline(run, {.stroke = ink, .stroke_width = 1.5, .dashes = "5 3"});
    }
    run.clear();
  };
  for (const Vector3& p_W : path) {
    const Vector2 p = on_canvas(camera, panel, p_W);
    if (is_inside(panel, p)) {
      run.push_back(p);
    } else {
      flush();
    }
  }
  flush();
}

void draw_arrow(SvgCanvas& canvas, const Vector2& from, const Vector2& to, std::string_view ink) {
  const Vector2 along = (to - from).normalized();
  const Vector2 across(-along.y(), along.x());
  constexpr Scalar kHead = 9;
  canvas.line(from, to, {.stroke = "#ffffff", .stroke_width = 4.5});
  canvas.line(from, to, {.stroke = ink, .stroke_width = 2});
  canvas.polygon(
      {to, to - kHead * along + 0.4 * kHead * across, to - kHead * along - 0.4 * kHead * across},
      {.fill = ink});
}

void draw_label(SvgCanvas& canvas, const Vector2& at, std::string_view words, SvgAnchor anchor,
                std::string_view ink) {
  canvas.text(at, words, 13, anchor, "#ffffff", true, 3);
  canvas.text(at, words, 13, anchor, ink, true);
}

void draw_pivot(SvgCanvas& canvas, const Vector2& at) {
  const Scalar r = 4.5;
  canvas.polygon({at + Vector2(r, 0), at + Vector2(0, r), at - Vector2(r, 0), at - Vector2(0, r)},
                 {.fill = kInkPivot, .stroke = "#ffffff", .stroke_width = 1});
}

// Witness points, pivot and normal; `reach` is the length of the normal's arrow in pixels.
void draw_witness(SvgCanvas& canvas, const Panel& panel, const Camera& camera,
                  const WitnessPair& witness, Scalar reach) {
  const Vector2 a = on_canvas(camera, panel, witness.p_WCa);
  const Vector2 b = on_canvas(camera, panel, witness.p_WCb);
  const Vector2 pivot = on_canvas(camera, panel, witness.pivot_W());
  const Vector3 tip_W =
      witness.pivot_W() + reach * kSharpness / camera.pixels_per_length * witness.nhat_AB_W;
  draw_arrow(canvas, pivot, on_canvas(camera, panel, tip_W), "#222222");
  canvas.line(a, b, {.stroke = "#222222", .stroke_width = 1.5});
  canvas.circle(a, 5, {.fill = kInkA, .stroke = "#ffffff", .stroke_width = 1.5});
  canvas.circle(b, 5, {.fill = kInkB, .stroke = "#ffffff", .stroke_width = 1.5});
  draw_pivot(canvas, pivot);
}

// Each name beside its witness point, on the side of its body.
void draw_names(SvgCanvas& canvas, const Panel& panel, const Camera& camera,
                const WitnessPair& witness) {
  const Vector2 a = on_canvas(camera, panel, witness.p_WCa);
  const Vector2 b = on_canvas(camera, panel, witness.p_WCb);
  const Vector2 n(camera.right_W.dot(witness.nhat_AB_W), -camera.up_W.dot(witness.nhat_AB_W));
  constexpr Scalar kAlong = 26;
  constexpr Scalar kAcross = 16;
  const Vector2 across(-n.y(), n.x());
  const Vector2 to_baseline(0, 5);
  draw_label(canvas, a - kAlong * n + kAcross * across + to_baseline, "A", SvgAnchor::Middle,
             kInkA);
  draw_label(canvas, b + kAlong * n + kAcross * across + to_baseline, "B", SvgAnchor::Middle,
             kInkB);
}

// Pixels of the canvas for a length.
Scalar close_up_scale(const Panel& panel, const PairScene& scene) {
  const Scalar gap = (scene.witness->p_WCb - scene.witness->p_WCa).norm();
  const Scalar part = kPartOfBody * std::min(scene.radius_a, scene.radius_b);
  return panel.size.minCoeff() / (2 * std::max(part, kGapsAcross / 2 * gap));
}

void draw_border(SvgCanvas& canvas, const Panel& panel) {
  canvas.rectangle(panel.corner, panel.size, {.stroke = "#c8ccd0"});
}

}  // namespace

void draw_pair(SvgCanvas& canvas, const Panel& panel, const PairScene& scene) {
  Camera camera = make_camera(scene);
  frame_all(camera, panel, scene);
  draw_image(canvas, panel, camera, scene);
  draw_path(canvas, panel, camera, scene.path_a, kInkA);
  draw_path(canvas, panel, camera, scene.path_b, kInkB);
  constexpr Scalar kReach = 42;
  if (scene.witness) draw_witness(canvas, panel, camera, *scene.witness, kReach);
  if (scene.meeting_W) draw_pivot(canvas, on_canvas(camera, panel, *scene.meeting_W));
  draw_border(canvas, panel);
}

bool has_close_up(const Panel& whole, const Panel& near, const PairScene& scene) {
  if (!scene.witness) return false;
  Camera camera = make_camera(scene);
  frame_all(camera, whole, scene);
  constexpr Scalar kNearer = 1.5;
  return close_up_scale(near, scene) * kSharpness > kNearer * camera.pixels_per_length;
}

void draw_close_up(SvgCanvas& canvas, const Panel& panel, const PairScene& scene) {
  if (!scene.witness) return;
  const WitnessPair& witness = *scene.witness;
  Camera camera = make_camera(scene);
  place(camera, panel, witness.pivot_W(), close_up_scale(panel, scene));
  PairScene now = scene;
  now.start.reset();
  draw_image(canvas, panel, camera, now);
  draw_witness(canvas, panel, camera, witness, 0.3 * panel.size.minCoeff());
  draw_names(canvas, panel, camera, witness);
  draw_border(canvas, panel);
}

}  // namespace dyop::cli
