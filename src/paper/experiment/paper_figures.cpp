// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "dyop/distance/triangle_distance.h"
#include "dyop/paper/planar_distance.h"
#include "dyop/paper/published_dyop.h"
#include "paper/experiment/paper_experiment.h"
#include "paper/experiment/svg_canvas.h"

namespace dyop::cli {
namespace {

constexpr int kFigureWidth = 860;
constexpr int kFigureHeight = 452;
constexpr Scalar kFigureLeft = 70;
constexpr Scalar kFigureRight = 20;
constexpr Scalar kFigureTop = 96;
constexpr Scalar kFigureBottom = 92;
constexpr Scalar kGroupShare = 0.8;            // fraction of an object's width taken by its bars
constexpr Scalar kPaperGjkGain[] = {78, 107};  // percent, the paper's worst and best object
constexpr Scalar kPaperLinCannyGain[] = {75, 187};
constexpr std::string_view kGrid = "#dddddd";
constexpr std::string_view kInk = "#222222";
constexpr std::string_view kWarning = "#b22222";

// Colours that people with any colour vision can distinguish (Okabe and Ito).
struct BarStyle {
  const char* name;
  const char* colour;
  bool is_striped;
};
constexpr BarStyle kBarStyles[] = {
    {"certified DyOP", "#0072b2", false}, {"certified DyOP, warm", "#003b5c", false},
    {"published DyOP", "#56b4e9", true},  {"GJK", "#e69f00", false},
    {"Lin-Canny", "#009e73", false},      {"libccd GJK", "#999999", false}};

// Values to pixels in the frame of a bar chart, with its grid and the names of the objects.
class Chart {
 public:
  Chart(SvgCanvas& canvas, Scalar low, Scalar high, std::string_view unit)
      : canvas_(canvas), low_(low), high_(high) {
    const Scalar step = round_step((high - low) / 6);
    for (Scalar value = std::ceil(low / step) * step; value <= high; value += step) {
      const Scalar y = y_of(value);
      canvas.line({kFigureLeft, y}, {kFigureWidth - kFigureRight, y}, {.stroke = kGrid});
      canvas.text({kFigureLeft - 8, y + 4}, std::to_string(std::lround(value)), 12, SvgAnchor::End);
    }
    canvas.line({kFigureLeft, y_of(0)}, {kFigureWidth - kFigureRight, y_of(0)}, {.stroke = kInk});
    canvas.vertical_text({20, (kFigureTop + kFigureHeight - kFigureBottom) / 2}, unit);
    for (int object = 1; object <= kObjectCount; ++object) {
      canvas.text({x_of(object) + object_width() / 2, kFigureHeight - kFigureBottom + 18},
                  "Obj" + std::to_string(object), 12, SvgAnchor::Middle);
    }
  }

  Scalar y_of(Scalar value) const {
    return kFigureHeight - kFigureBottom -
           (value - low_) / (high_ - low_) * (kFigureHeight - kFigureBottom - kFigureTop);
  }
  static Scalar object_width() {
    return (kFigureWidth - kFigureLeft - kFigureRight) / kObjectCount;
  }
  static Scalar x_of(int object) { return kFigureLeft + (object - 1) * object_width(); }

  // Left side and width of bar k of `count`.
  static Vector2 bar(int object, std::size_t k, std::size_t count) {
    const Scalar width = object_width() * kGroupShare / static_cast<Scalar>(count);
    const Scalar margin = object_width() * (1 - kGroupShare) / 2;
    return {x_of(object) + margin + static_cast<Scalar>(k) * width, width};
  }

  void draw_bar(int object, std::size_t k, std::size_t count, Scalar value, std::string_view fill,
                std::string_view stroke) {
    const Vector2 place = bar(object, k, count);
    const Scalar top = std::min(y_of(value), y_of(0));
    canvas_.rectangle({place.x(), top}, {place.y() - 1, std::abs(y_of(value) - y_of(0))},
                      {.fill = fill, .stroke = stroke, .stroke_width = 0.5});
  }

 private:
  // 1, 2 or 5 times a power of ten, at least `least`.
  static Scalar round_step(Scalar least) {
    Scalar step = 1;
    while (step < least) {
      if (2 * step >= least) return 2 * step;
      if (5 * step >= least) return 5 * step;
      step *= 10;
    }
    return step;
  }

  SvgCanvas& canvas_;
  Scalar low_;
  Scalar high_;
};

void draw_header(SvgCanvas& canvas, const std::string& title, const std::string& subtitle) {
  canvas.text({kFigureLeft, 26}, title, 17, SvgAnchor::Start, kInk, true);
  canvas.text({kFigureLeft, 46}, subtitle, 12, SvgAnchor::Start, "#555555");
}

// Draws one entry of a legend; returns where the next one starts.
Scalar draw_key(SvgCanvas& canvas, Scalar x, std::string_view name, std::string_view fill,
                std::string_view stroke) {
  canvas.rectangle({x, 62}, {14, 12}, {.fill = fill, .stroke = stroke, .stroke_width = 0.5});
  canvas.text({x + 19, 72}, name);
  return x + 42 + 7 * static_cast<Scalar>(name.size());
}

std::string fill_of(SvgCanvas& canvas, const BarStyle& style) {
  return style.is_striped ? canvas.add_stripes(style.colour) : std::string(style.colour);
}

// The column that the paper lacks.
void draw_wrong_tests(SvgCanvas& canvas, const PaperSeries& series) {
  const AlgorithmMeasurement& published = series.of("published DyOP");
  const Scalar y = kFigureHeight - kFigureBottom + 38;
  for (int object = 1; object <= kObjectCount; ++object) {
    const int wrong = published.objects[static_cast<std::size_t>(object - 1)].wrong_tests;
    canvas.text({Chart::x_of(object) + Chart::object_width() / 2, y},
                std::to_string(wrong) + " of 9 wrong", 10, SvgAnchor::Middle,
                wrong > 0 ? kWarning : kInk);
  }
  int wrong_others = 0;
  for (const AlgorithmMeasurement& algorithm : series.algorithms) {
    if (&algorithm != &published) wrong_others += algorithm.wrong_tests();
  }
  char factors[96];
  std::snprintf(factors, sizeof factors, "on average %.1f, at worst %.1f times the true distance",
                published.mean_factor, published.worst_factor);
  canvas.text({kFigureLeft, y + 22},
              "Wrong: published DyOP in " + std::to_string(published.wrong_tests()) +
                  " of the 90 tests (there " + factors + "), all others in " +
                  std::to_string(wrong_others) + ".",
              12, SvgAnchor::Start, kWarning);
}

// Names of the objects for which certified DyOP gains less than the smallest gain in the paper.
std::string objects_below(const PaperSeries& series, const char* slow, Scalar least) {
  std::string names;
  int count = 0;
  for (int object = 1; object <= kObjectCount; ++object) {
    if (gain_percent(series.best_certified_dyop(), series.of(slow), object) >= least) continue;
    if (count++ > 0) names += ", ";
    names += std::to_string(object);
  }
  if (count == 0) return "no object";
  return count == kObjectCount ? "every object" : "object " + names;
}

// Stated where the paper's smallest gains are missed.
void draw_missed_claims(SvgCanvas& canvas, const PaperSeries& series) {
  canvas.text({kFigureLeft, kFigureHeight - 12},
              "Certified DyOP below the paper's worst case: over GJK (78 %) " +
                  objects_below(series, "GJK", kPaperGjkGain[0]) + "; over Lin-Canny (75 %) " +
                  objects_below(series, "Lin-Canny", kPaperLinCannyGain[0]) + ".",
              12);
}

}  // namespace

std::string draw_times(const PaperSeries& series, const PaperSettings& settings) {
  const std::string title = "Time of one distance query, " + series.title();
  SvgCanvas canvas(kFigureWidth, kFigureHeight, title);
  draw_header(canvas, title,
              "each object against the 9 others, 0.1 apart" +
                  std::string(series.is_moving ? " at the end of each path" : "") +
                  "; median and quartiles of " + std::to_string(settings.repetitions) +
                  " interleaved repetitions");
  Scalar high = 0;
  std::vector<BarStyle> styles;
  for (const BarStyle& style : kBarStyles) {
    if (series.has(style.name)) styles.push_back(style);
  }
  for (const BarStyle& style : styles) {
    for (const ObjectMeasurement& object : series.of(style.name).objects) {
      high = std::max(high, object.upper_quartile_ns);
    }
  }
  Chart chart(canvas, 0, 1.05 * high, "nanoseconds");
  Scalar x = kFigureLeft;
  std::size_t k = 0;
  for (const BarStyle& style : styles) {
    const std::string fill = fill_of(canvas, style);
    x = draw_key(canvas, x, style.name, fill, style.colour);
    const AlgorithmMeasurement& algorithm = series.of(style.name);
    for (int object = 1; object <= kObjectCount; ++object) {
      const ObjectMeasurement& m = algorithm.objects[static_cast<std::size_t>(object - 1)];
      chart.draw_bar(object, k, styles.size(), m.median_ns, fill, style.colour);
      const Vector2 place = Chart::bar(object, k, styles.size());
      const Scalar middle = place.x() + (place.y() - 1) / 2;
      canvas.line({middle, chart.y_of(m.lower_quartile_ns)},
                  {middle, chart.y_of(m.upper_quartile_ns)}, {.stroke = kInk});
    }
    ++k;
  }
  draw_wrong_tests(canvas, series);
  return canvas.str();
}

std::string draw_gains(const PaperSeries& series, const PaperSettings& settings) {
  struct Gain {
    const char* fast;
    const char* slow;
    const char* label;
    const char* colour;
    bool is_striped;
  };
  const char* certified = series.best_certified_dyop().name.c_str();
  const Gain gains[] = {
      {certified, "GJK", "certified over GJK", "#e69f00", false},
      {"published DyOP", "GJK", "published over GJK", "#e69f00", true},
      {certified, "Lin-Canny", "certified over Lin-Canny", "#009e73", false},
      {"published DyOP", "Lin-Canny", "published over Lin-Canny", "#009e73", true}};
  const std::string title = "Gain of DyOP, " + series.title();
  SvgCanvas canvas(kFigureWidth, kFigureHeight, title);
  draw_header(
      canvas, title,
      "percent by which a query is faster; medians of " + std::to_string(settings.repetitions) +
          " interleaved repetitions; bands: the paper's range, in 2D" +
          (series.best_certified_dyop().name == "certified DyOP" ? "" : "; certified is warm"));
  Scalar low = 0;
  Scalar high = 200;
  for (const Gain& gain : gains) {
    for (int object = 1; object <= kObjectCount; ++object) {
      const Scalar percent = gain_percent(series.of(gain.fast), series.of(gain.slow), object);
      low = std::min(low, 1.05 * percent);
      high = std::max(high, 1.05 * percent);
    }
  }
  Chart chart(canvas, low, high, "percent");
  const auto draw_band = [&](Scalar from, Scalar to, std::string_view colour) {
    canvas.rectangle({kFigureLeft, chart.y_of(to)},
                     {kFigureWidth - kFigureLeft - kFigureRight, chart.y_of(from) - chart.y_of(to)},
                     {.fill = colour, .opacity = 0.13});
  };
  draw_band(kPaperGjkGain[0], kPaperGjkGain[1], "#e69f00");
  draw_band(kPaperLinCannyGain[0], kPaperLinCannyGain[1], "#009e73");
  Scalar x = kFigureLeft;
  std::size_t k = 0;
  for (const Gain& gain : gains) {
    const std::string fill =
        gain.is_striped ? canvas.add_stripes(gain.colour) : std::string(gain.colour);
    x = draw_key(canvas, x, gain.label, fill, gain.colour);
    for (int object = 1; object <= kObjectCount; ++object) {
      chart.draw_bar(object, k, std::size(gains),
                     gain_percent(series.of(gain.fast), series.of(gain.slow), object), fill,
                     gain.colour);
    }
    ++k;
  }
  draw_wrong_tests(canvas, series);
  draw_missed_claims(canvas, series);
  return canvas.str();
}

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

namespace {

// A number with this many decimals.
std::string fixed(Scalar x, int decimals) {
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%.*f", decimals, x);
  return buffer;
}

struct Range {
  Scalar low;
  Scalar high;
};

Range gain_range(const AlgorithmMeasurement& fast, const AlgorithmMeasurement& slow) {
  Range range{kInfinity, -kInfinity};
  for (int object = 1; object <= kObjectCount; ++object) {
    const Scalar gain = gain_percent(fast, slow, object);
    range = {std::min(range.low, gain), std::max(range.high, gain)};
  }
  return range;
}

Range time_range(const AlgorithmMeasurement& algorithm) {
  Range range{kInfinity, 0};
  for (const ObjectMeasurement& object : algorithm.objects) {
    range = {std::min(range.low, object.median_ns), std::max(range.high, object.median_ns)};
  }
  return range;
}

std::string words(const Range& range, int decimals = 0) {
  return fixed(range.low, decimals) + " to " + fixed(range.high, decimals);
}

void describe_series(std::ostringstream& out, const PaperSeries& series) {
  const bool has_warm = &series.best_certified_dyop() != &series.of("certified DyOP");
  out << "\n## " << series.title() << "\n\n"
      << "| algorithm | ns per query | " << (has_warm ? "warm certified DyOP faster by, % | " : "")
      << "certified DyOP faster by, % | published DyOP faster by, % | "
         "wrong of 90 | value / truth when wrong: mean | worst | queries wrong, % |\n"
      << "|---|---|---|---|---|---|---|---|" << (has_warm ? "---|" : "") << '\n';
  const AlgorithmMeasurement& certified = series.of("certified DyOP");
  const AlgorithmMeasurement& best = series.best_certified_dyop();
  const AlgorithmMeasurement& published = series.of("published DyOP");
  for (const AlgorithmMeasurement& algorithm : series.algorithms) {
    const auto gain_of = [&](const AlgorithmMeasurement& fast) {
      return &fast == &algorithm ? std::string("-") : words(gain_range(fast, algorithm));
    };
    const bool is_wrong = algorithm.wrong_tests() > 0;
    out << "| " << algorithm.name << " | " << words(time_range(algorithm)) << " | "
        << (has_warm ? gain_of(best) + " | " : "") << gain_of(certified) << " | "
        << gain_of(published) << " | " << algorithm.wrong_tests() << " | "
        << (is_wrong ? fixed(algorithm.mean_factor, 2) : "-") << " | "
        << (is_wrong ? fixed(algorithm.worst_factor, 2) : "-") << " | "
        << fixed(100 * algorithm.wrong_query_share(), 3) << " |\n";
  }
}

void describe_errors(std::ostringstream& out, const PaperResults& results) {
  out << "\n## Errors of published DyOP by gap\n\n"
      << results.settings.error_pairs
      << " random pairs per row, in a square or cube of side 2, brought to the gap.\n\n"
      << "| dimension | gap | wrong, % | value / truth when wrong: mean | worst |\n"
      << "|---|---|---|---|---|\n";
  for (const GapErrors& row : results.errors) {
    out << "| " << row.dimension << " | " << row.gap << " | "
        << fixed(100.0 * row.wrong / row.pairs, 1) << " | " << fixed(row.mean_factor, 2) << " | "
        << fixed(row.worst_factor, 1) << " |\n";
  }
}

}  // namespace

std::string describe_paper(const PaperResults& results) {
  std::ostringstream out;
  out << "# The experiment of the DyOP paper\n\n"
      << "Ten random triangles, each moved against the nine others until they are " << kPaperGap
      << " apart: 90 tests.\nSeed " << results.settings.seed << ", " << results.settings.repetitions
      << " interleaved repetitions of " << 9 * results.settings.copies
      << " queries per object, no input twice.\nRanges are over the ten objects; times are "
         "medians. "
         "Wrong: off by more than "
      << kWrongBy << ".\n";
  for (const PaperSeries& series : results.series) describe_series(out, series);
  describe_errors(out, results);
  Scalar widest = 0;
  for (const TestRecord& test : results.tests) widest = std::max(widest, test.upper - test.lower);
  out << "\nThe true distance of each of the 90 tests is proven to within " << widest << ".\n";
  return out.str();
}

std::string paper_times_csv(const PaperResults& results) {
  std::ostringstream out;
  out << "dimension,moving,object,algorithm,median_ns,lower_quartile_ns,upper_quartile_ns,"
         "certified_dyop_gain_percent,published_dyop_gain_percent,wrong_tests_of_9,wrong_queries,"
         "queries\n";
  for (const PaperSeries& series : results.series) {
    const AlgorithmMeasurement& certified = series.of("certified DyOP");
    const AlgorithmMeasurement& published = series.of("published DyOP");
    for (int object = 1; object <= kObjectCount; ++object) {
      for (const AlgorithmMeasurement& algorithm : series.algorithms) {
        const ObjectMeasurement& m = algorithm.objects[static_cast<std::size_t>(object - 1)];
        out << series.dimension << ',' << series.is_moving << ',' << object << ",\""
            << algorithm.name << "\"," << fixed(m.median_ns, 2) << ','
            << fixed(m.lower_quartile_ns, 2) << ',' << fixed(m.upper_quartile_ns, 2) << ','
            << fixed(gain_percent(certified, algorithm, object), 1) << ','
            << fixed(gain_percent(published, algorithm, object), 1) << ',' << m.wrong_tests << ','
            << m.wrong_queries << ',' << m.queries << '\n';
      }
    }
  }
  return out.str();
}

std::string paper_tests_csv(const PaperResults& results) {
  std::ostringstream out;
  out.precision(17);
  out << "dimension,object,against";
  for (const char* triangle : {"a", "b"}) {
    for (int k = 0; k < 3; ++k) {
      for (const char* axis : {"x", "y", "z"}) out << ',' << triangle << k << axis;
    }
  }
  out << ",lower,upper";
  for (const std::string& name : results.algorithm_names) out << ",\"" << name << '"';
  out << '\n';
  for (const TestRecord& test : results.tests) {
    out << test.dimension << ',' << test.object << ',' << test.against;
    for (std::size_t k = 0; k < test.vertices.size(); ++k) {
      out << ',' << test.vertices[k];
      if (test.dimension == 2 && k % 2 == 1) out << ",0";  // z
    }
    out << ',' << test.lower << ',' << test.upper;
    for (const Scalar value : test.values) out << ',' << value;
    out << '\n';
  }
  return out.str();
}

std::string paper_json(const PaperResults& results) {
  nlohmann::ordered_json json;
  json["seed"] = results.settings.seed;
  json["repetitions"] = results.settings.repetitions;
  json["gap"] = kPaperGap;
  for (const PaperSeries& series : results.series) {
    for (const AlgorithmMeasurement& algorithm : series.algorithms) {
      const Range times = time_range(algorithm);
      const Range gains = gain_range(series.of("certified DyOP"), algorithm);
      nlohmann::ordered_json row;
      row["dimension"] = series.dimension;
      row["is_moving"] = series.is_moving;
      row["algorithm"] = algorithm.name;
      row["is_certified"] = algorithm.is_certified;
      row["median_ns"] = {times.low, times.high};
      row["certified_dyop_gain_percent"] = {gains.low, gains.high};
      row["wrong_tests"] = algorithm.wrong_tests();
      row["mean_factor_when_wrong"] = algorithm.mean_factor;
      row["worst_factor"] = algorithm.worst_factor;
      row["wrong_query_share"] = algorithm.wrong_query_share();
      json["results"].push_back(row);
    }
  }
  return json.dump();
}

}  // namespace dyop::cli
