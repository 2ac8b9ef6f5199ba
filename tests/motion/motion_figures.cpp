// SPDX-License-Identifier: BSD-3-Clause

// Draws, for every motion of tests/motion/all_motions.h, its speed and its angular acceleration by
// dense sampling, and the bounds over eight parts of the time:
//   motion_figures FILE.svg
// docs/figures/motion-bounds.svg is what it draws.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "motion/all_motions.h"
#include "motion/motion_test_tools.h"
#include "paper/experiment/svg_canvas.h"

namespace dyop::testing {
namespace {

using cli::SvgCanvas;
using cli::SvgStyle;

constexpr int kColumns = 4;
constexpr int kParts = 8;
constexpr int kSamples = 200;
constexpr Scalar kWidth = 230, kHeight = 200;
const SvgStyle kBound{.stroke = "#c1442e", .stroke_width = 1.5};
const SvgStyle kGrid{.stroke = "#d5d8dc", .stroke_width = 0.7};
const SvgStyle kTruth{.stroke = "#1f5fa8", .stroke_width = 1.5};

// One quantity of one motion in the box at `corner`.
class Plot {
 public:
  Plot(SvgCanvas& canvas, const Vector2& corner, const Motion& motion)
      : canvas_(canvas), corner_(corner), motion_(motion) {}

  void draw(const char* name, const std::function<Scalar(Scalar)>& truth,
            Scalar TwistBound::*bound) {
    std::vector<Scalar> bounds, values;
    for (int i = 0; i < kParts; ++i) {
      bounds.push_back(motion_.twist_bound({part(i), part(i + 1)}).*bound);
    }
    for (int i = 0; i <= kSamples; ++i) values.push_back(truth(Scalar(i) / kSamples));
    top_ = 1e-9;  // literal: so that what is zero lies on the ground
    for (const Scalar x : bounds) top_ = std::max(top_, std::isfinite(x) ? x : 0);
    for (const Scalar x : values) top_ = std::max(top_, std::isfinite(x) ? x : 0);
    canvas_.rectangle(corner_, kSize, {.fill = "#f6f6f4"});
    for (int i = 0; i < kParts; ++i) draw_bound(i, bounds[std::size_t(i)]);
    std::vector<Vector2> curve;
    for (int i = 0; i <= kSamples; ++i) {
      const Scalar value = values[std::size_t(i)];
      if (std::isfinite(value)) curve.push_back(at(Scalar(i) / kSamples, value));
      if (std::isfinite(value) && i < kSamples) continue;
      canvas_.polyline(curve, kTruth);
      curve.clear();
    }
    canvas_.text(corner_ + Vector2(3, 11), name, 9);
    draw_numbers();
  }

 private:
  static inline const Vector2 kSize = Vector2(kWidth - 20, 66);

  static Scalar part(int i) { return Scalar(i) / kParts; }
  // Times below, zero and the largest value at the right, where the curves leave space.
  void draw_numbers() {
    for (const Scalar t : {0.0, 0.5, 1.0}) {
      canvas_.text(at(t, 0) + Vector2(0, 8), words(t), 8,
                   t == 0   ? cli::SvgAnchor::Start
                   : t == 1 ? cli::SvgAnchor::End
                            : cli::SvgAnchor::Middle);
    }
    canvas_.line(at(0, top_), at(1, top_), kGrid);
    canvas_.text(at(1, top_) + Vector2(-2, -2), words(top_), 8, cli::SvgAnchor::End);
    canvas_.text(at(1, 0) + Vector2(-2, -2), "0", 8, cli::SvgAnchor::End);
  }
  static std::string words(Scalar x) {
    std::ostringstream out;
    out.precision(3);
    out << x;
    return out.str();
  }
  Vector2 at(Scalar t, Scalar value) const {
    return corner_ + Vector2(t * kSize.x(), kSize.y() * (1 - 0.72 * value / top_));
  }
  // No bound, where the twist jumps inside the part, is a dark ground.
  void draw_bound(int i, Scalar bound) {
    if (!std::isfinite(bound)) {
      canvas_.rectangle(corner_ + Vector2(part(i) * kSize.x(), 0),
                        Vector2(kSize.x() / kParts, kSize.y()), {.fill = "#e3d2ce"});
      return;
    }
    canvas_.line(at(part(i), bound), at(part(i + 1), bound), kBound);
  }

  SvgCanvas& canvas_;
  const Vector2 corner_;
  const Motion& motion_;
  Scalar top_ = 1;
};

void draw_motion(SvgCanvas& canvas, const Vector2& corner, const char* name, const Motion& motion) {
  std::string title = name;
  std::replace(title.begin(), title.end(), '_', ' ');
  canvas.text(corner + Vector2(0, 12), title, 12, cli::SvgAnchor::Start, "#222222", true);
  Plot(canvas, corner + Vector2(0, 18), motion)
      .draw(
          "speed", [&](Scalar t) { return motion.twist(t).v_WB.norm(); },
          &TwistBound::linear_speed);
  const auto angular_acceleration = [&](Scalar t) {
    const Scalar step = 1.0 / 4096;
    const Scalar x = std::clamp(t, 3 * step, 1 - 3 * step);
    if (motion.smooth_until(x - 3 * step) < x + 3 * step) return kInfinity;
    return differentiate([&](Scalar s) { return motion.twist(s).w_WB; }, x, step).norm();
  };
  Plot(canvas, corner + Vector2(0, 98), motion)
      .draw("angular acceleration", angular_acceleration, &TwistBound::angular_acceleration);
}

int run(const char* file) {
  const int rows = (int(kAllMotions.size()) + kColumns - 1) / kColumns;
  SvgCanvas canvas(int(kColumns * kWidth) + 20, int(rows * kHeight) + 50,
                   "Motions and their bounds");
  canvas.text({12, 20},
              "Sampled (blue) and bound over eight parts of the time (red); dark: no bound,", 12);
  canvas.text({12, 36}, "the twist jumps. Each plot has its own scale.", 12);
  Random random(3);
  for (std::size_t i = 0; i < kAllMotions.size(); ++i) {
    const Vector2 corner(12 + kWidth * Scalar(i % kColumns), 46 + kHeight * Scalar(i / kColumns));
    const MotionPointer motion = kAllMotions[i].make(random, {1, 1, 3, {0, 1}});
    draw_motion(canvas, corner, kAllMotions[i].name, *motion);
  }
  std::ofstream out(file);
  out << canvas.str();
  out.close();
  if (out) return 0;
  std::fprintf(stderr, "motion_figures: cannot write %s\n", file);
  return 2;
}

}  // namespace
}  // namespace dyop::testing

int main(int argc, char** argv) {
  if (argc == 2) return dyop::testing::run(argv[1]);
  std::fprintf(stderr, "usage: motion_figures FILE.svg\n");
  return 2;
}
