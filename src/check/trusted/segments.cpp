// SPDX-License-Identifier: BSD-3-Clause
#include "check/trusted/segments.h"

namespace dyop_check {
namespace {

constexpr std::size_t kNodeNumbers = 13;
constexpr std::size_t kChartNumbers = 9;
constexpr double kOrthogonal = 1e-9;    // literal: entries of R^T R - 1
constexpr int kMostNestedMotions = 50;  // motions within motions

using Kind = Segment::Kind;

// How far R^T R is from 1; NaN if R is not finite.
double skew_of(const Mat& R) {
  const Mat product = transpose(R) * R;
  double sum = 0;
  for (std::size_t i = 0; i < 9; ++i) sum += std::abs(product.m[i] - (i % 4 == 0 ? 1 : 0));
  return sum;
}

double larger(const Vec& a, const Vec& b) {
  return std::max(norm(a), norm(b));
}

// At R, until it is given curves.
Segment moving(const Mat& R, double t0) {
  Segment g;
  g.kind = Kind::Moving;
  g.t0 = t0;
  g.R = R;
  g.skew = skew_of(R);
  return g;
}

}  // namespace

Segment at_rest(const Pose& X) {
  Segment g = moving(X.R, 0);
  g.place = {X.p};
  return g;
}

Segment twist(const Mat& R, const Vec& p, const Vec& v, const Vec& w, double t0) {
  Segment g = moving(R, t0);
  g.place = {p, v};
  g.turn = {Vec{}, transposed(R, w)};
  return g;
}

namespace {

// The cubic through two values with two rates, h apart.
Curve hermite(double h, const Vec& x0, const Vec& v0, const Vec& x1, const Vec& v1) {
  const Vec d = x1 - x0;
  return {x0, v0, (1 / (h * h)) * (3.0 * d - h * (2.0 * v0 + v1)),
          (1 / (h * h * h)) * (h * (v0 + v1) - 2.0 * d)};
}

// An end of a cubic: place and velocity of the centre of mass, rotation vector and its rate.
struct CubicNode {
  Vec p, v, theta, theta_rate;
};

Segment cubic(const Mat& R, double t0, double t1, const CubicNode& first, const CubicNode& last) {
  Segment g = moving(R, t0);
  g.length = t1 - t0;
  if (!(g.length > 0)) throw BadFile("a cubic has no length");
  g.place = hermite(g.length, first.p, first.v, last.p, last.v);
  g.turn = hermite(g.length, first.theta, first.theta_rate, last.theta, last.theta_rate);
  g.rough_place = larger(first.p, last.p) + g.length * larger(first.v, last.v);
  g.rough_turn =
      larger(first.theta, last.theta) + g.length * larger(first.theta_rate, last.theta_rate);
  return g;
}

// A Bezier curve over a length h, from the differences of its points. `rough` becomes the size of
// all that is added up.
Curve bezier(double h, std::vector<Vec> points, double& rough) {
  Curve curve;
  double largest = 0;
  for (const Vec& point : points) largest = std::max(largest, norm(point));
  const std::size_t degree = points.size() - 1;
  double choose = 1;  // of `degree` things k, over h^k
  for (std::size_t k = 0; k <= degree; ++k) {
    curve.push_back(choose * points[0]);
    for (std::size_t i = 0; i + k < degree; ++i) points[i] = points[i + 1] - points[i];
    choose *= double(degree - k) / (double(k + 1) * h);
  }
  rough = std::pow(3, double(degree)) * largest;
  return curve;
}

Vec vector_at(const Json& json, const char* key) {
  return vector_of(json.at(key).to_numbers(3));
}

Pose pose_at(const Json& json, const char* key) {
  const Json& X = json.at(key);
  return {matrix_of(X.at("rotation").to_numbers(9)), vector_at(X, "position")};
}

// Prescribed motions, as those of the body's frame: parts in order of time.
class Prescribed {
 public:
  explicit Prescribed(const Vec& center_of_mass) : center_of_mass_(center_of_mass) {}

  std::vector<Segment> read(const Json& motion, int depth = 0) const {
    if (depth > kMostNestedMotions) throw BadFile("a motion is nested too deeply");
    const std::string& kind = motion.at("kind").text;
    if (kind == "sequence") return sequence(motion, depth);
    if (kind == "sampled") return sampled(motion);
    if (kind == "composed") return composed(motion, depth);
    if (kind == "rest") return {at_rest(pose_at(motion, "X_WB"))};
    if (kind == "screw") return {screw(motion)};
    if (kind == "constant_twist") {
      const Pose X = pose_at(motion, "X_WB0");
      return {twist(X.R, X.p, vector_at(motion, "v_WB"), vector_at(motion, "w_WB"),
                    motion.at("t0").to_number())};
    }
    const std::vector<double> interval = motion.at("interval").to_numbers(2);
    const Mat R = pose_at(motion, "X_WC").R;
    if (kind == "hermite") {
      return {cubic(R, interval[0], interval[1], node(motion.at("begin")), node(motion.at("end")))};
    }
    if (kind == "interpolated")
      return {polynomial(R, interval, {motion.at("begin"), motion.at("end")})};
    if (kind == "bezier") return {polynomial(R, interval, motion.at("control_points").list)};
    throw BadFile("the kind of motion '" + kind + "' is unknown");
  }

  // What of the parts is left from a time on; the first begins then.
  static std::vector<Segment> from(std::vector<Segment> parts, double begin) {
    while (parts.size() > 1 && parts[1].begin <= begin) parts.erase(parts.begin());
    parts.front().begin = begin;
    return parts;
  }

 private:
  static CubicNode node(const Json& json) {
    return {vector_at(json, "p_WB"), vector_at(json, "v_WB"), vector_at(json, "theta"),
            vector_at(json, "theta_rate")};
  }

  static Segment polynomial(const Mat& R, const std::vector<double>& interval,
                            const std::vector<Json>& points) {
    Segment g = moving(R, interval[0]);
    g.length = interval[1] - interval[0];
    if (!(g.length > 0) || points.size() < 2 || points.size() > kMostTerms)
      throw BadFile("a curve has no length, or an impossible number of points");
    std::vector<Vec> places;
    std::vector<Vec> turns;
    for (const Json& point : points) {
      places.push_back(vector_at(point, "p_WB"));
      turns.push_back(vector_at(point, "theta"));
    }
    g.place = bezier(g.length, places, g.rough_place);
    g.turn = bezier(g.length, turns, g.rough_turn);
    return g;
  }

  // About the point of the axis that is nearest to the centre of mass.
  Segment screw(const Json& motion) const {
    const Pose X = pose_at(motion, "X_WB0");
    const Vec any = vector_at(motion, "axis_W");
    if (!(norm(any) > 0)) throw BadFile("a screw has no axis");
    const Vec axis = (1 / norm(any)) * any;
    const Vec on_axis = vector_at(motion, "p_WA");
    const Vec p = on_axis + dot(axis, X * center_of_mass_ - on_axis) * axis;
    Segment g = twist(X.R, p, motion.at("slide_rate").to_number() * axis,
                      motion.at("turn_rate").to_number() * axis, motion.at("t0").to_number());
    g.p_cm = transposed(X.R, p - X.p);
    return g;
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
      Segment& g = parts.emplace_back(twist(X.R, X.p, (1 / h) * (Y.p - X.p), (1 / h) * turn, t));
      if (norm(turn) > kLargestTurn) g.kind = Kind::Unsupported;
      g.begin = t;
      g.length = h;
      g.skew += skew_of(Y.R);
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

  // X_WM(t) X_MB(t): every part of the one through every part of the other at the same time.
  std::vector<Segment> composed(const Json& motion, int depth) const {
    const std::vector<Segment> outer = read(motion.at("X_WM"), depth + 1);
    const std::vector<Segment> inner = read(motion.at("X_MB"), depth + 1);
    std::vector<Segment> all;
    for (std::size_t i = 0, j = 0;;) {
      Segment& g = all.emplace_back(through(inner[i], std::make_shared<Segment>(outer[j])));
      g.begin = std::max(i > 0 ? inner[i].begin : -kInfinity, j > 0 ? outer[j].begin : -kInfinity);
      const double next_i = i + 1 < inner.size() ? inner[i + 1].begin : kInfinity;
      const double next_j = j + 1 < outer.size() ? outer[j + 1].begin : kInfinity;
      if (next_i == kInfinity && next_j == kInfinity) return all;
      if (next_i <= next_j) ++i;
      if (next_j <= next_i) ++j;
    }
  }

  static Segment through(Segment g, const std::shared_ptr<const Segment>& outer) {
    if (!outer->is_known()) g.kind = outer->kind;
    g.outer = g.outer ? std::make_shared<Segment>(through(*g.outer, outer)) : outer;
    return g;
  }

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

Pose pose_of(const Json& json) {
  const std::vector<double> x = json.to_numbers(12);
  return {matrix_of(x), vector_of(x, 9)};
}

std::vector<Segment> prescribed(const Json& motion, double begin, const Vec& center_of_mass) {
  std::vector<Segment> parts = Prescribed::from(Prescribed(center_of_mass).read(motion), begin);
  for (Segment& g : parts) g.lever = norm(g.p_cm - center_of_mass);
  return parts;
}

std::vector<Segment> SegmentReader::read(std::uint64_t kind, std::uint64_t first, std::size_t body,
                                         double begin, const Vec& center_of_mass) {
  if (kind == 4) return prescribed(given(take(first, 2)), begin, center_of_mass);
  Segment g;
  if (kind == 1) {
    const std::vector<double> x = take(first, 12);
    g = at_rest({matrix_of(x), vector_of(x, 9)});
  } else if (kind == 2) {
    const std::vector<double> x = take(first, 19);
    g = twist(matrix_of(x), vector_of(x, 9), vector_of(x, 12), vector_of(x, 15), x[18]);
  } else if (kind != 0) {
    const std::vector<double> x = whole_cubic(kind, first, body);
    const auto node = [&](std::size_t at) {
      return CubicNode{vector_of(x, at + 1), vector_of(x, at + 4), vector_of(x, at + 7),
                       vector_of(x, at + 10)};
    };
    constexpr std::size_t kLast = kChartNumbers + kNodeNumbers;
    g = cubic(matrix_of(x), x[kChartNumbers], x[kLast], node(kChartNumbers), node(kLast));
    previous_[body].assign(x.end() - std::ptrdiff_t(kNodeNumbers), x.end());
  }
  g.begin = begin;
  // A body that rests, or is only approximately known (5), follows the motion of its own frame.
  if (kind != 1 && kind != 5) g.p_cm = center_of_mass;
  g.lever = norm(g.p_cm - center_of_mass);
  return {g};
}

std::vector<double> SegmentReader::take(std::uint64_t first, std::size_t count) const {
  if (first > numbers_.size() || count > numbers_.size() - first)
    throw BadFile("a segment's numbers are out of range");
  const auto begin = numbers_.begin() + std::ptrdiff_t(first);
  std::vector<double> x(begin, begin + std::ptrdiff_t(count));
  for (const double value : x) {
    if (!std::isfinite(value)) throw BadFile("a segment's number is not finite");
  }
  return x;
}

// The forms 3 and 5 to 9 of docs/formats.md as chart, start and end.
std::vector<double> SegmentReader::whole_cubic(std::uint64_t kind, std::uint64_t first,
                                               std::size_t body) const {
  if (kind == 3 || kind == 5) return take(first, kChartNumbers + 2 * kNodeNumbers);
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

Json SegmentReader::given(const std::vector<double>& place) const {
  const auto size = double(given_.size());
  if (!(place[0] >= 0 && place[0] <= size && place[1] >= 0 && place[1] <= size - place[0]))
    throw BadFile("a motion is out of range");
  return parse_json(std::string_view(given_).substr(std::size_t(place[0]), std::size_t(place[1])));
}

}  // namespace dyop_check
