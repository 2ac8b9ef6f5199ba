// SPDX-License-Identifier: BSD-3-Clause
#include "paper/experiment/paper_figures.h"

#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace dyop::cli
