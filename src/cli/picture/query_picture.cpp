// SPDX-License-Identifier: BSD-3-Clause
#include "cli/picture/query_picture.h"

#include <algorithm>
#include <sstream>

#include "cli/picture/gap_plot.h"
#include "cli/picture/pair_view.h"
#include "dyop/io/file_error.h"
#include "dyop/io/result_text.h"
#include "dyop/toi/time_of_impact.h"
#include "io/file_bytes.h"

namespace dyop::cli {
namespace {

constexpr int kWidth = 1000;
constexpr Scalar kMargin = 24;
constexpr Scalar kLineHeight = 17;
constexpr Scalar kSceneHeight = 400;
constexpr Scalar kSceneWidth = 590;
constexpr Scalar kPlotHeight = 230;
constexpr int kSamples = 240;
constexpr int kMostSteps = 400;
constexpr int kPathPoints = 200;
// How often the triangles of spheres and other smooth shapes are divided.
constexpr int kFineness = 5;

std::string time_words(Scalar x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// "  name         value" and "  name: value" as their two columns; else all in the first.
std::pair<std::string, std::string> columns_of(const std::string& line) {
  const auto first = std::min(line.find_first_not_of(' '), line.size());
  const std::string words = line.substr(first);
  const auto gap = std::min(words.find("  "), words.find(": "));
  constexpr std::size_t kLongestName = 12;
  if (first == 0 || gap == std::string::npos || gap > kLongestName) return {words, ""};
  const auto value = words.find_first_not_of(": ", gap);
  return {words.substr(0, gap), value == std::string::npos ? "" : words.substr(value)};
}

// The first line is the headline. Returns where the next thing may begin.
Scalar draw_words(SvgCanvas& canvas, const std::vector<std::string>& lines, Scalar top) {
  Scalar y = top;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const auto [name, value] = columns_of(lines[k]);
    if (k == 0 || value.empty()) {
      canvas.text({kMargin, y}, name, k == 0 ? 16 : 12, SvgAnchor::Start, "#222222", k == 0);
    } else {
      canvas.text({kMargin, y}, name, 12, SvgAnchor::Start, "#555b61");
      canvas.text({kMargin + 100, y}, value, 12);
    }
    y += k == 0 ? 1.5 * kLineHeight : kLineHeight;
  }
  return y;
}

// A second view only if it is nearer than the first.
void draw_scene(SvgCanvas& canvas, const PairScene& scene, Scalar top, std::string_view caption) {
  const Scalar x = 2 * kMargin + kSceneWidth;
  const Panel near{{x, top}, {kWidth - kMargin - x, kSceneHeight}};
  Panel whole{{kMargin, top}, {kSceneWidth, kSceneHeight}};
  const bool has_two = has_close_up(whole, near, scene);
  if (!has_two) whole.size.x() = kWidth - 2 * kMargin;
  draw_pair(canvas, whole, scene);
  const Scalar y = top + kSceneHeight + kLineHeight;
  canvas.text({kMargin, y}, caption, 12, SvgAnchor::Start, "#555b61");
  if (!has_two) return;
  draw_close_up(canvas, near, scene);
  canvas.text({x, y}, "from near: witness points, normal, pivot (diamond)", 12, SvgAnchor::Start,
              "#555b61");
}

std::vector<Vector3> path_of(const Motion& motion, const TimeInterval& interval) {
  std::vector<Vector3> path;
  for (int k = 0; k <= kPathPoints; ++k) {
    const Scalar t =
        k == kPathPoints ? interval.end : interval.begin + interval.length() * k / kPathPoints;
    path.push_back(motion.pose(t).translation());
  }
  return path;
}

PairScene scene_of(const Shape& a, const RigidPose& X_WA, const Shape& b, const RigidPose& X_WB) {
  PairScene scene;
  const std::array<const Shape*, 2> shapes{&a, &b};
  const Scalar plate = view_internal::plate_beside(shapes) / 10;
  scene.a = view_internal::surface_of(a, kFineness, plate);
  scene.b = view_internal::surface_of(b, kFineness, plate);
  scene.radius_a = view_internal::drawn_radius(a, plate);
  scene.radius_b = view_internal::drawn_radius(b, plate);
  scene.X_WA = X_WA;
  scene.X_WB = X_WB;
  return scene;
}

Scalar tolerance_of(const ToiQuery& query) {
  return query.options.distance_tolerance ? *query.options.distance_tolerance
                                          : default_distance_tolerance(*query.a, *query.b);
}

// The witness of the query, or where it has none the nearest points at the time that is drawn.
// Shapes that overlap have no nearest points and no normal, but a place where they meet.
void add_witness(const ToiQuery& query, const ToiResult& result, PairScene& scene) {
  if (result.contact && result.status == ToiStatus::Impact) {
    scene.witness = *result.contact;
    return;
  }
  const DistanceResult gap = distance(*query.a, scene.X_WA, *query.b, scene.X_WB);
  if (gap.status == DistanceStatus::Overlapping) {
    scene.meeting_W = gap.pivot_W();
  } else {
    scene.witness = gap;
  }
}

// The sample with the least gap, then nearer: the least of the gap between its neighbours.
GapSample least_gap(const ToiQuery& query, const GapHistory& history) {
  const auto& samples = history.samples;
  const auto least = std::ranges::min_element(samples, {}, &GapSample::lower);
  Scalar begin = least == samples.begin() ? least->t : std::prev(least)->t;
  Scalar end = std::next(least) == samples.end() ? least->t : std::next(least)->t;
  DistanceCache cache;
  const auto at = [&](Scalar t) {
    const DistanceResult gap =
        distance(*query.a, query.X_WA->pose(t), *query.b, query.X_WB->pose(t), {}, cache);
    return GapSample{t, gap.lower, gap.upper};
  };
  constexpr int kThirds = 40;
  GapSample best = *least;
  for (int k = 0; k < kThirds; ++k) {
    const GapSample left = at(begin + (end - begin) / 3);
    const GapSample right = at(end - (end - begin) / 3);
    if (left.upper < best.upper) best = left;
    if (right.upper < best.upper) best = right;
    (left.upper < right.upper ? end : begin) = (left.upper < right.upper ? right : left).t;
  }
  return best;
}

std::string point_words(const Vector3& p) {
  return "(" + time_words(p.x()) + ", " + time_words(p.y()) + ", " + time_words(p.z()) + ")";
}

// Shapes that never meet are drawn where they come nearest: the end would show nothing.
struct Moment {
  Scalar t = 0;
  std::string words;
};

Moment drawn_moment(const ToiQuery& query, const ToiResult& result, const GapHistory& history) {
  if (result.status != ToiStatus::Separated) return {result.t_safe, "at t_safe"};
  const GapSample least = least_gap(query, history);
  return {least.t, "where the gap, as sampled, is least: t = " + time_words(least.t)};
}

// The least distance of a miss, and where it is.
std::string miss_words(const PairScene& scene, Scalar t) {
  const WitnessPair& witness = *scene.witness;
  return "  least        " + time_words(witness.lower) + " (sampled) at t = " + time_words(t) +
         ", from A at " + point_words(witness.p_WCa) + " to B at " + point_words(witness.p_WCb);
}

}  // namespace

std::string toi_picture(const ToiQuery& query, const ToiResult& result) {
  const GapHistory history = gap_history(query, tolerance_of(query), kSamples, kMostSteps);
  const Moment moment = drawn_moment(query, result, history);
  const Scalar t = moment.t;
  PairScene scene = scene_of(*query.a, query.X_WA->pose(t), *query.b, query.X_WB->pose(t));
  const TimeInterval before{query.interval.begin, t};
  scene.path_a = path_of(*query.X_WA, before);
  scene.path_b = path_of(*query.X_WB, before);
  if (before.length() > 0) {
    scene.start = {query.X_WA->pose(before.begin), query.X_WB->pose(before.begin)};
  }
  add_witness(query, result, scene);
  std::vector<std::string> lines = lines_of(describe(result));
  if (result.status == ToiStatus::Separated && scene.witness) {
    lines.insert(lines.begin() + 1, miss_words(scene, t));
  }
  constexpr Scalar kBelowScene = 3.6 * kLineHeight;
  const Scalar words = kMargin + kLineHeight * (Scalar(lines.size()) + 1.5);
  const int height =
      int(words + kSceneHeight + kBelowScene + kPlotHeight + 3 * kLineHeight + kMargin);
  SvgCanvas canvas(kWidth, height, lines.front());
  Scalar y = draw_words(canvas, lines, kMargin + 0.6 * kLineHeight);
  draw_scene(canvas, scene, y,
             moment.words + "; faint: at the start; dashed: paths of the origins");
  y += kSceneHeight + kBelowScene;
  draw_gap(canvas, {{kMargin + 66, y}, {kWidth - 2 * kMargin - 66, kPlotHeight}}, query, result,
           history);
  return canvas.str();
}

std::string distance_picture(const Shape& a, const RigidPose& X_WA, const Shape& b,
                             const RigidPose& X_WB, const DistanceResult& result) {
  PairScene scene = scene_of(a, X_WA, b, X_WB);
  const bool has_witness = result.status != DistanceStatus::NotRun && result.upper < kInfinity;
  const bool overlaps = result.status == DistanceStatus::Overlapping;
  if (has_witness && overlaps) scene.meeting_W = result.pivot_W();
  if (has_witness && !overlaps) scene.witness = result;
  const std::vector<std::string> lines = lines_of(describe(result));
  const Scalar words = kMargin + kLineHeight * (Scalar(lines.size()) + 1.5);
  SvgCanvas canvas(kWidth, int(words + kSceneHeight + 2.5 * kLineHeight), lines.front());
  const Scalar y = draw_words(canvas, lines, kMargin + 0.6 * kLineHeight);
  draw_scene(
      canvas, scene, y,
      overlaps ? "A blue, B orange; diamond: a place where they overlap" : "A blue, B orange");
  return canvas.str();
}

namespace {

std::string page_of(const std::string& svg) {
  return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n<title>dyop</title>\n"
         "<style>body{margin:0;background:#fff}svg{display:block;margin:auto;max-width:100%;"
         "height:auto}</style>\n</head>\n<body>\n" +
         svg + "</body>\n</html>\n";
}

}  // namespace

void require_picture(const std::filesystem::path& file) {
  const std::filesystem::path ending = file.extension();
  if (ending == ".png") {
    png_of(file, "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"1\" height=\"1\"/>");
  } else if (ending != ".svg" && ending != ".html") {
    throw FileError(file, "expected a picture .svg, .png or .html");
  }
}

void write_picture(const std::filesystem::path& file, const std::string& svg) {
  std::string bytes = svg;
  if (file.extension() == ".png") bytes = png_of(file, svg);
  if (file.extension() == ".html") bytes = page_of(svg);
  io_internal::write_whole_file(file, bytes);
}

}  // namespace dyop::cli
