// SPDX-License-Identifier: BSD-3-Clause
#include "check/segments.h"

#include <cmath>

namespace dyop_check {
namespace {

constexpr std::size_t kNodeNumbers = 13;
constexpr std::size_t kChartNumbers = 9;
constexpr double kOrthogonal = 1e-9;  // literal: entries of R^T R - 1
constexpr double kLargestTurn = 2.5;  // radians between two samples; near pi the axis is uncertain
constexpr int kMostNested = 50;       // motions within motions

using Kind = Segment::Kind;

// How far R^T R is from 1; NaN if R is not finite.
double skew_of(const Mat& R) {
  const Mat product = transpose(R) * R;
  double sum = 0;
  for (std::size_t i = 0; i < 9; ++i) sum += std::abs(product.m[i] - (i % 4 == 0 ? 1 : 0));
  return sum;
}

CubicNode node_of(const std::vector<double>& x, std::size_t at) {
  return {x.at(at), vector_of(x, at + 1), vector_of(x, at + 4), vector_of(x, at + 7),
          vector_of(x, at + 10)};
}

Vec vector_at(const Json& json, const char* key) {
  return vector_of(json.at(key).to_numbers(3));
}

Pose pose_at(const Json& json, const char* key) {
  const Json& X = json.at(key);
  return {matrix_of(X.at("rotation").to_numbers(9)), vector_of(X.at("position").to_numbers(3))};
}

// Prescribed motions, as those of the body's frame.
class Prescribed {
 public:
  explicit Prescribed(const Vec& center_of_mass) : center_of_mass_(center_of_mass) {}

  /// Parts in order of time; the first holds before its `begin`, too.
  std::vector<Segment> read(const Json& motion, int depth = 0) const {
    if (depth > kMostNested) throw BadFile("a motion is nested too deeply");
    const std::string& kind = motion.at("kind").text;
    if (kind == "sequence") return sequence(motion, depth);
    if (kind == "sampled") return sampled(motion);
    if (kind == "composed") return composed(motion, depth);
    if (kind == "rest") return {rest(pose_at(motion, "X_WB"))};
    if (kind == "constant_twist") {
      const Pose X = pose_at(motion, "X_WB0");
      return {twist(X, X.p, vector_at(motion, "v_WB"), vector_at(motion, "w_WB"),
                    motion.at("t0").to_number())};
    }
    if (kind == "screw") return {screw(motion)};
    if (kind == "interpolated" || kind == "hermite" || kind == "bezier") return {cubic(motion)};
    throw BadFile("the kind of motion '" + kind + "' is unknown");
  }

 private:
  static Segment rest(const Pose& X) {
    Segment g;
    g.kind = Kind::Rest;
    g.R = X.R;
    g.p = X.p;
    return g;
  }

  // About the point of the body that is at `p` at t0.
  static Segment twist(const Pose& X, const Vec& p, const Vec& v, const Vec& w, double t0) {
    Segment g;
    g.kind = Kind::Twist;
    g.R = X.R;
    g.p = p;
    g.p_cm = transposed(X.R, p - X.p);
    g.v = v;
    g.w = w;
    g.t0 = t0;
    return g;
  }

  // About the point of the axis that is nearest to the centre of mass.
  Segment screw(const Json& motion) const {
    const Pose X = pose_at(motion, "X_WB0");
    const Vec any = vector_at(motion, "axis_W");
    if (!(norm(any) > 0)) throw BadFile("a screw has no axis");
    const Vec axis = (1 / norm(any)) * any;
    const Vec p = vector_at(motion, "p_WA");
    return twist(X, p + dot(axis, X * center_of_mass_ - p) * axis,
                 motion.at("slide_rate").to_number() * axis,
                 motion.at("turn_rate").to_number() * axis, motion.at("t0").to_number());
  }

  static Segment cubic(const Json& motion) {
    Segment g;
    g.kind = Kind::Cubic;
    g.R = pose_at(motion, "X_WC").R;
    const std::vector<double> interval = motion.at("interval").to_numbers(2);
    g.first.t = interval[0];
    g.last.t = interval[1];
    const double h = interval[1] - interval[0];
    if (!(h > 0)) throw BadFile("a motion has no length");
    const std::string& kind = motion.at("kind").text;
    if (kind == "bezier") {
      set_curve(g, motion.at("control_points").list, h);
      return g;
    }
    for (const auto& [node, key] : {std::pair(&g.first, "begin"), std::pair(&g.last, "end")}) {
      const Json& json = motion.at(key);
      node->p = vector_at(json, "p_WB");
      node->theta = vector_at(json, "theta");
      if (kind != "hermite") continue;
      node->v = vector_at(json, "v_WB");
      node->theta_rate = vector_at(json, "theta_rate");
    }
    if (kind == "interpolated") {
      g.first.v = g.last.v = (1 / h) * (g.last.p - g.first.p);
      g.first.theta_rate = g.last.theta_rate = (1 / h) * (g.last.theta - g.first.theta);
    }
    return g;
  }

  // A Bezier curve of up to the third degree is a cubic: of its ends, and its rates there.
  static void set_curve(Segment& g, const std::vector<Json>& points, double h) {
    if (points.size() < 2) throw BadFile("a curve has fewer than two points");
    if (points.size() > 4) {
      g.kind = Kind::Unsupported;
      return;
    }
    const double rate = double(points.size() - 1) / h;
    const auto set = [&](CubicNode& node, const Json& at, const Json& from, const Json& to) {
      node.p = vector_at(at, "p_WB");
      node.theta = vector_at(at, "theta");
      node.v = rate * (vector_at(to, "p_WB") - vector_at(from, "p_WB"));
      node.theta_rate = rate * (vector_at(to, "theta") - vector_at(from, "theta"));
    };
    set(g.first, points[0], points[0], points[1]);
    set(g.last, points.back(), points[points.size() - 2], points.back());
  }

  // Between two samples the origin moves along a line, and the body turns the shortest way.
  static std::vector<Segment> sampled(const Json& motion) {
    std::vector<Segment> parts;
    const std::vector<Json>& samples = motion.at("samples").list;
    for (std::size_t k = 0; k + 1 < samples.size(); ++k) {
      const double t = samples[k].at("t").to_number();
      const double h = samples[k + 1].at("t").to_number() - t;
      if (!(h > 0)) throw BadFile("samples are not in order of time");
      const Pose X = pose_at(samples[k], "X_WB");
      const Pose Y = pose_at(samples[k + 1], "X_WB");
      const Vec turn = rotation_vector(Y.R * transpose(X.R));
      Segment g = twist(X, X.p, (1 / h) * (Y.p - X.p), (1 / h) * turn, t);
      if (norm(turn) > kLargestTurn) g.kind = Kind::Unsupported;
      g.begin = t;
      parts.push_back(g);
    }
    if (parts.empty()) throw BadFile("a motion has fewer than two samples");
    return parts;
  }

  std::vector<Segment> sequence(const Json& motion, int depth) const {
    std::vector<Segment> all;
    for (const Json& part : motion.at("parts").list) {
      const std::vector<double> interval = part.at("interval").to_numbers(2);
      for (Segment& g : from(read(part.at("motion"), depth + 1), interval[0])) {
        if (g.begin < interval[1]) all.push_back(g);
      }
    }
    if (all.empty()) throw BadFile("a motion has no parts");
    return all;
  }

  // X_WM(t) X_MB(t), of which one does not move.
  std::vector<Segment> composed(const Json& motion, int depth) const {
    std::vector<Segment> outer = read(motion.at("X_WM"), depth + 1);
    std::vector<Segment> inner = read(motion.at("X_MB"), depth + 1);
    if (outer.size() == 1 && outer[0].kind == Kind::Rest) {
      for (Segment& g : inner) place_in(g, {outer[0].R, outer[0].p});
      return inner;
    }
    const bool is_fixed = inner.size() == 1 && inner[0].kind == Kind::Rest;
    for (Segment& g : outer) {
      if (is_fixed) {
        shift(g, {inner[0].R, inner[0].p});
      } else {
        g.kind = Kind::Unsupported;
      }
    }
    return outer;
  }

  // The same motion as seen from a frame in which its world is at X.
  static void place_in(Segment& g, const Pose& X) {
    g.R = X.R * g.R;
    g.p = X * g.p;
    g.v = X.R * g.v;
    g.w = X.R * g.w;
    for (CubicNode* node : {&g.first, &g.last}) {
      node->p = X * node->p;
      node->v = X.R * node->v;
    }
  }

  // The motion of a frame that is fixed at X in the moving one.
  static void shift(Segment& g, const Pose& X) {
    if (g.kind == Kind::Rest) g.p = g.p + g.R * X.p;
    g.R = g.R * X.R;
    g.p_cm = transposed(X.R, g.p_cm - X.p);
    for (CubicNode* node : {&g.first, &g.last}) {
      node->theta = transposed(X.R, node->theta);
      node->theta_rate = transposed(X.R, node->theta_rate);
    }
  }

 public:
  // What of the parts is left from a time on; the first begins then.
  static std::vector<Segment> from(std::vector<Segment> parts, double begin) {
    std::size_t first = 0;
    while (first + 1 < parts.size() && parts[first + 1].begin <= begin) ++first;
    parts.erase(parts.begin(), parts.begin() + std::ptrdiff_t(first));
    parts.front().begin = begin;
    return parts;
  }

 private:
  Vec center_of_mass_;
};

}  // namespace

Vec vector_of(const std::vector<double>& x, std::size_t at) {
  return {x.at(at), x.at(at + 1), x.at(at + 2)};
}

Mat matrix_of(const std::vector<double>& x, std::size_t at) {
  Mat R;
  for (std::size_t i = 0; i < 9; ++i) R.m[i] = x.at(at + i);
  if (!(skew_of(R) <= kOrthogonal)) throw BadFile("a rotation is not orthonormal");
  return R;
}

std::vector<Segment> prescribed(const Json& motion, double begin, const Vec& center_of_mass) {
  std::vector<Segment> parts = Prescribed::from(Prescribed(center_of_mass).read(motion), begin);
  for (Segment& g : parts) {
    g.lever = norm(g.p_cm - center_of_mass);
    g.skew = skew_of(g.R);
  }
  return parts;
}

std::vector<Segment> SegmentReader::read(std::uint32_t kind, std::uint64_t first, std::size_t body,
                                         double begin, const Vec& center_of_mass) {
  if (kind == 4) return prescribed(given(take(first, 2)), begin, center_of_mass);
  Segment g;
  g.begin = begin;
  g.p_cm = center_of_mass;
  switch (kind) {
    case 0:
      break;
    case 1: {
      const std::vector<double> x = take(first, 12);
      g.kind = Kind::Rest;
      g.R = matrix_of(x);
      g.p = vector_of(x, 9);
      break;
    }
    case 2: {
      const std::vector<double> x = take(first, 19);
      g.kind = Kind::Twist;
      g.R = matrix_of(x);
      g.p = vector_of(x, 9);
      g.v = vector_of(x, 12);
      g.w = vector_of(x, 15);
      g.t0 = x[18];
      break;
    }
    case 5:  // of the body's frame, not of its centre of mass
      g.p_cm = {};
      g.lever = norm(center_of_mass);
      set_cubic(g, body, take(first, kChartNumbers + 2 * kNodeNumbers));
      break;
    default:
      set_cubic(g, body, whole_cubic(kind, first, body));
  }
  g.skew = skew_of(g.R);
  return {g};
}

std::vector<double> SegmentReader::take(std::uint64_t first, std::size_t count) const {
  if (first > numbers_.size() || count > numbers_.size() - first)
    throw BadFile("a segment's numbers are out of range");
  std::vector<double> x(numbers_.begin() + std::ptrdiff_t(first),
                        numbers_.begin() + std::ptrdiff_t(first + count));
  for (const double value : x) {
    if (!std::isfinite(value)) throw BadFile("a segment's number is not finite");
  }
  return x;
}

// The forms 3 and 6 to 9 of docs/formats.md as chart, start and end.
std::vector<double> SegmentReader::whole_cubic(std::uint32_t kind, std::uint64_t first,
                                               std::size_t body) const {
  if (kind == 3) return take(first, kChartNumbers + 2 * kNodeNumbers);
  if (kind < 6 || kind > 9) throw BadFile("the kind of a segment is unknown");
  const bool has_chart = kind == 6;
  const std::size_t start_count = kind == 7 ? kNodeNumbers : kind == 9 ? 0 : 6;
  const std::size_t chart_count = has_chart ? kChartNumbers : 1;
  const std::vector<double> x = take(first, chart_count + start_count + kNodeNumbers);
  std::vector<double> whole(x.begin(), x.begin() + std::ptrdiff_t(chart_count));
  if (!has_chart) {
    if (!(x[0] >= 0 && x[0] < double(numbers_.size()))) throw BadFile("a chart is out of range");
    whole = take(std::uint64_t(x[0]), kChartNumbers);
  }
  const std::vector<double>& before = previous_[body];
  if (start_count < kNodeNumbers) {
    if (before.empty()) throw BadFile("a segment continues none");
    whole.insert(whole.end(), before.begin(),
                 before.begin() + std::ptrdiff_t(kNodeNumbers - start_count));
  }
  whole.insert(whole.end(), x.begin() + std::ptrdiff_t(chart_count), x.end());
  return whole;
}

void SegmentReader::set_cubic(Segment& g, std::size_t body, const std::vector<double>& x) {
  g.kind = Kind::Cubic;
  g.R = matrix_of(x);
  g.first = node_of(x, kChartNumbers);
  g.last = node_of(x, kChartNumbers + kNodeNumbers);
  if (!(g.last.t > g.first.t)) throw BadFile("a cubic has no length");
  previous_[body].assign(x.end() - std::ptrdiff_t(kNodeNumbers), x.end());
}

Json SegmentReader::given(const std::vector<double>& place) const {
  const auto size = double(given_.size());
  if (!(place[0] >= 0 && place[0] <= size && place[1] >= 0 && place[1] <= size - place[0]))
    throw BadFile("a motion is out of range");
  return parse_json(std::string_view(given_).substr(std::size_t(place[0]), std::size_t(place[1])));
}

}  // namespace dyop_check
