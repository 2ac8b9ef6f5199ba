// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/gap_plot.h"

#include <algorithm>
#include <cmath>

#include "io/json_reader.h"

namespace dyop::cli {
namespace {

constexpr std::string_view kInkGap = "#222222";
constexpr std::string_view kInkStep = "#1a8a4c";
constexpr std::string_view kInkProven = "#e3f4e8";
constexpr std::string_view kInkHit = "#c22f2f";
constexpr std::string_view kInkGrid = "#e4e7ea";
constexpr std::string_view kInkTick = "#555b61";

// A round number, at least so large.
Scalar round_step(Scalar least) {
  const Scalar power = std::pow(10, std::floor(std::log10(least)));
  for (const Scalar factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= least) return factor * power;
  }
  return 10 * power;
}

class Axes {
 public:
  Axes(const Panel& panel, const TimeInterval& times, Scalar top)
      : panel_(panel), times_(times), top_(top) {}

  Vector2 at(Scalar t, Scalar gap) const {
    const Scalar x = (t - times_.begin) / times_.length();
    const Scalar y = std::clamp(gap / top_, Scalar(0), Scalar(1));
    return panel_.corner + Vector2(x * panel_.size.x(), (1 - y) * panel_.size.y());
  }

  void draw(SvgCanvas& canvas) const {
    constexpr Scalar kTicksAcross = 8;
    constexpr Scalar kTicksUp = 5;
    const Scalar step_t = round_step(times_.length() / kTicksAcross);
    // literal: a tick at the very end may lie beyond it by rounding
    for (Scalar k = std::ceil(times_.begin / step_t); k * step_t <= times_.end + 1e-9 * step_t;
         ++k) {
      const Vector2 p = at(k * step_t, 0);
      canvas.line(p, at(k * step_t, top_), {.stroke = kInkGrid});
      canvas.text(p + Vector2(0, 17), io_internal::show(k * step_t, step_t), 11, SvgAnchor::Middle,
                  kInkTick);
    }
    const Scalar step_y = round_step(top_ / kTicksUp);
    for (Scalar k = 0; k * step_y <= top_; ++k) {
      const Vector2 p = at(times_.begin, k * step_y);
      canvas.line(p, at(times_.end, k * step_y), {.stroke = kInkGrid});
      canvas.text(p + Vector2(-7, 4), io_internal::show(k * step_y, step_y), 11, SvgAnchor::End,
                  kInkTick);
    }
    canvas.text(panel_.corner + Vector2(panel_.size.x() / 2, panel_.size.y() + 36), "time", 12,
                SvgAnchor::Middle);
    canvas.vertical_text(panel_.corner + Vector2(-58, panel_.size.y() / 2), "gap");
  }

 private:
  Panel panel_;
  TimeInterval times_;
  Scalar top_;
};

void draw_steps(SvgCanvas& canvas, const Axes& axes, const GapHistory& history) {
  std::vector<Vector2> saw;
  for (const GapStep& step : history.steps) {
    saw.push_back(axes.at(step.t, step.lower));
    saw.push_back(axes.at(step.t + step.length, step.lower - step.speed * step.length));
  }
  if (!saw.empty()) canvas.polyline(saw, {.stroke = kInkStep, .stroke_width = 1.4});
  for (const GapStep& step : history.steps) {
    canvas.circle(axes.at(step.t, step.lower), 2.2, {.fill = kInkStep});
  }
}

void draw_legend(SvgCanvas& canvas, const Panel& panel, const GapHistory& history) {
  Scalar x = panel.corner.x();
  const auto entry = [&](std::string_view ink, const std::string& words, Scalar width) {
    const Scalar y = panel.corner.y() - 12;
    canvas.line({x, y - 4}, {x + 22, y - 4}, {.stroke = ink, .stroke_width = 2.5});
    canvas.text({x + 28, y}, words, 12);
    x += width;
  };
  entry(kInkGap, "gap (sampled)", 140);
  if (!history.steps.empty()) {
    const std::size_t count = history.steps.size();
    entry(kInkStep,
          "proven lower bound: " + std::to_string(count) + (count == 1 ? " step" : " steps") +
              " of conservative advancement" + (history.is_cut ? ", and more" : ""),
          430);
  }
  entry(kInkHit, "t_safe, t_hit", 120);
}

void draw_time(SvgCanvas& canvas, const Axes& axes, Scalar t, Scalar top, std::string_view dashes) {
  canvas.line(axes.at(t, 0), axes.at(t, top),
              {.stroke = kInkHit, .stroke_width = 1.6, .dashes = dashes});
}

}  // namespace

void draw_gap(SvgCanvas& canvas, const Panel& panel, const ToiQuery& query, const ToiResult& result,
              const GapHistory& history) {
  Scalar top = query.options.target_distance;
  for (const GapSample& sample : history.samples) top = std::max(top, sample.lower);
  constexpr Scalar kHeadroom = 1.08;
  top = top > 0 ? kHeadroom * top : 1;
  const Axes axes(panel, query.interval, top);
  const Vector2 proven = axes.at(result.t_safe, top);
  canvas.rectangle(panel.corner, {proven.x() - panel.corner.x(), panel.size.y()},
                   {.fill = kInkProven});
  axes.draw(canvas);
  if (query.options.target_distance > 0) {
    const Vector2 end = axes.at(query.interval.end, query.options.target_distance);
    canvas.line(axes.at(query.interval.begin, query.options.target_distance), end,
                {.stroke = kInkHit, .dashes = "2 3"});
    canvas.text(end + Vector2(-4, -5), "target", 11, SvgAnchor::End, kInkHit);
  }
  std::vector<Vector2> curve;
  for (const GapSample& sample : history.samples) curve.push_back(axes.at(sample.t, sample.lower));
  canvas.polyline(curve, {.stroke = kInkGap, .stroke_width = 1.8});
  draw_steps(canvas, axes, history);
  draw_time(canvas, axes, result.t_safe, top, "");
  if (result.t_hit) draw_time(canvas, axes, *result.t_hit, top, "4 3");
  if (result.t_safe > query.interval.begin) {
    canvas.text(panel.corner + Vector2(8, 18), "proven apart", 12, SvgAnchor::Start, kInkStep);
  }
  canvas.rectangle(panel.corner, panel.size, {.stroke = "#9aa0a6"});
  draw_legend(canvas, panel, history);
}

}  // namespace dyop::cli
