// SPDX-License-Identifier: BSD-3-Clause
#include "io/record/motion_rows.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "dyop/motion/composed_motion.h"
#include "dyop/motion/interpolated_motion.h"
#include "dyop/motion/steady_motions.h"
#include "io/motion_json.h"

namespace dyop::io_internal {
namespace {

class NumberWriter {
 public:
  explicit NumberWriter(std::vector<Scalar>& numbers) : numbers_(numbers) {}
  void put(Scalar x) { numbers_.push_back(x); }
  void put(const Vector3& v) { numbers_.insert(numbers_.end(), v.begin(), v.end()); }
  void put(const Matrix3& R) {
    for (Eigen::Index i = 0; i < 3; ++i) put(Vector3(R.row(i)));
  }
  void put(Scalar t, const HermiteNode& node) {
    put(t);
    put(node.p_WB);
    put(node.v_WB);
    put(node.theta);
    put(node.theta_rate);
  }

 private:
  std::vector<Scalar>& numbers_;
};

class NumberReader {
 public:
  explicit NumberReader(std::span<const Scalar> numbers) : numbers_(numbers) {}
  Scalar scalar() { return numbers_[next_++]; }
  Vector3 vector() {
    const Scalar x = scalar();
    const Scalar y = scalar();
    return {x, y, scalar()};
  }
  Matrix3 matrix() {
    Matrix3 R;
    for (Eigen::Index i = 0; i < 3; ++i) R.row(i) = vector();
    return R;
  }
  RigidPose pose() {
    const Matrix3 R = matrix();
    return RigidPose::from_trusted(R, vector());
  }
  HermiteNode node() {
    HermiteNode node;
    node.p_WB = vector();
    node.v_WB = vector();
    node.theta = vector();
    node.theta_rate = vector();
    return node;
  }

 private:
  std::span<const Scalar> numbers_;
  std::size_t next_ = 0;
};

// True if the frame B has the axes of M and its origin at -p_BoBcm.
bool is_offset(const Motion& inner, const Vector3& p_BoBcm) {
  const auto* rest = dynamic_cast<const RestMotion*>(&inner);
  if (rest == nullptr) return false;
  const RigidPose X_MB = rest->pose(0);
  return X_MB.rotation() == Matrix3::Identity() && X_MB.translation() == -p_BoBcm;
}

// The motion of the frame M, or null if B does not move with a frame at its centre of mass.
const Motion* central_motion(const Motion& motion, const Vector3& p_BoBcm) {
  const auto* composed = dynamic_cast<const ComposedMotion*>(&motion);
  if (composed == nullptr) return p_BoBcm.isZero(0) ? &motion : nullptr;
  if (p_BoBcm.isZero(0) || !is_offset(composed->inner(), p_BoBcm)) return nullptr;
  return &composed->outer();
}

EncodedMotion encode_rest(const RestMotion& motion) {
  EncodedMotion result{SegmentKind::Rest, {}, {}};
  NumberWriter out(result.numbers);
  const RigidPose X_WB = motion.pose(0);
  out.put(X_WB.rotation());
  out.put(X_WB.translation());
  return result;
}

EncodedMotion encode_twist(const ConstantTwistMotion& motion) {
  EncodedMotion result{SegmentKind::Twist, {}, {}};
  NumberWriter out(result.numbers);
  const Twist twist = motion.twist(motion.t0());
  out.put(motion.X_WB0().rotation());
  out.put(motion.X_WB0().translation());
  out.put(twist.v_WB);
  out.put(twist.w_WB);
  out.put(motion.t0());
  return result;
}

EncodedMotion encode_hermite(const HermiteMotion& motion, SegmentKind kind) {
  EncodedMotion result{kind, {}, {}};
  NumberWriter out(result.numbers);
  out.put(motion.X_WC().rotation());
  out.put(motion.domain().begin, motion.begin());
  out.put(motion.domain().end, motion.end());
  return result;
}

EncodedMotion encode_given(const MotionPart& part) {
  try {
    return {SegmentKind::Given, {}, record_motion(*part.motion).dump()};
  } catch (const InvalidArgument&) {  // of the user's functions
    const HermiteMotion cubic(part.interval, part.motion->state(part.interval.begin),
                              part.motion->state(part.interval.end));
    return encode_hermite(cubic, SegmentKind::Approximate);
  }
}

std::shared_ptr<const Motion> decode_hermite(std::span<const Scalar> numbers) {
  NumberReader in(numbers);
  const RigidPose X_WC = RigidPose::from_trusted(in.matrix(), Vector3::Zero());
  const Scalar begin = in.scalar();
  const HermiteNode first = in.node();
  const Scalar end = in.scalar();
  return std::make_shared<HermiteMotion>(
      HermiteMotion::from_chart({begin, end}, X_WC, first, in.node()));
}

std::shared_ptr<const Motion> decode_twist(std::span<const Scalar> numbers) {
  NumberReader in(numbers);
  const RigidPose X_WM0 = in.pose();
  const Vector3 v_WM = in.vector();
  const Twist twist{v_WM, in.vector()};
  return std::make_shared<ConstantTwistMotion>(X_WM0, twist, in.scalar());
}

std::shared_ptr<const Motion> about_center(std::shared_ptr<const Motion> X_WM,
                                           const Vector3& p_BoBcm) {
  if (p_BoBcm.isZero(0)) return X_WM;
  return std::make_shared<ComposedMotion>(
      std::move(X_WM), std::make_shared<RestMotion>(RigidPose(Vector3(-p_BoBcm))));
}

void require_length(const EncodedMotion& encoded, std::size_t expected) {
  DYOP_REQUIRE(encoded.numbers.size() == expected, "a segment of kind ",
               static_cast<std::uint32_t>(encoded.kind), " has ", encoded.numbers.size(),
               " numbers, not ", expected);
}

}  // namespace

std::size_t number_count(SegmentKind kind) {
  switch (kind) {
    case SegmentKind::Absent:
      return 0;
    case SegmentKind::Rest:
      return kRestNumbers;
    case SegmentKind::Twist:
      return kTwistNumbers;
    case SegmentKind::Hermite:
    case SegmentKind::Approximate:
      return kHermiteNumbers;
    case SegmentKind::Given:
      return kGivenNumbers;
  }
  return 0;
}

std::vector<MotionPart> parts_of(const std::shared_ptr<const Motion>& motion,
                                 const TimeInterval& interval) {
  const auto* sequence = dynamic_cast<const SequenceMotion*>(motion.get());
  if (sequence == nullptr) return {{interval, motion}};
  std::vector<MotionPart> parts;
  for (const SequenceMotion::Part& part : sequence->parts()) {
    const TimeInterval common{std::max(part.interval.begin, interval.begin),
                              std::min(part.interval.end, interval.end)};
    if (!(common.begin < common.end)) continue;
    for (MotionPart& inner : parts_of(part.motion, common)) parts.push_back(std::move(inner));
  }
  return parts;
}

EncodedMotion encode(const MotionPart& part, const Vector3& p_BoBcm) {
  if (const auto* rest = dynamic_cast<const RestMotion*>(part.motion.get())) {
    return encode_rest(*rest);
  }
  const Motion* central = central_motion(*part.motion, p_BoBcm);
  if (const auto* twist = dynamic_cast<const ConstantTwistMotion*>(central)) {
    return encode_twist(*twist);
  }
  if (const auto* hermite = dynamic_cast<const HermiteMotion*>(central)) {
    return encode_hermite(*hermite, SegmentKind::Hermite);
  }
  return encode_given(part);
}

std::shared_ptr<const Motion> decode(const EncodedMotion& encoded, const Vector3& p_BoBcm) {
  switch (encoded.kind) {
    case SegmentKind::Absent:
      return nullptr;
    case SegmentKind::Rest:
      require_length(encoded, kRestNumbers);
      return std::make_shared<RestMotion>(NumberReader(encoded.numbers).pose());
    case SegmentKind::Twist:
      require_length(encoded, kTwistNumbers);
      return about_center(decode_twist(encoded.numbers), p_BoBcm);
    case SegmentKind::Hermite:
      require_length(encoded, kHermiteNumbers);
      return about_center(decode_hermite(encoded.numbers), p_BoBcm);
    case SegmentKind::Given: {  // its numbers are the place of its text
      const std::filesystem::path place = "motion of a recording";
      const Json json = parse_json(place, encoded.given);
      return recorded_motion(JsonNode(place, json));
    }
    case SegmentKind::Approximate:
      require_length(encoded, kHermiteNumbers);
      return decode_hermite(encoded.numbers);
  }
  DYOP_REQUIRE(false, "unknown segment kind ", static_cast<std::uint32_t>(encoded.kind));
  return nullptr;
}

namespace {

constexpr std::size_t kTurnNumbers = 6;  // theta and theta_rate, the last of a node

// As in docs/formats.md; the shortest first, so that the first one that serves is taken.
constexpr std::array<HermiteForm, 5> kForms{{{9, false, 0},
                                             {8, false, kTurnNumbers},
                                             {7, false, kNodeNumbers},
                                             {6, true, kTurnNumbers},
                                             {3, true, kNodeNumbers}}};

// Bits, not values: NaN and the sign of zero are kept.
bool are_same(std::span<const Scalar> a, std::span<const Scalar> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

}  // namespace

const HermiteForm* hermite_form(std::uint32_t kind) {
  const auto form = std::find_if(kForms.begin(), kForms.end(),
                                 [&](const HermiteForm& one) { return one.kind == kind; });
  return form == kForms.end() ? nullptr : &*form;
}

const HermiteForm& shortest_form(std::span<const Scalar> before, std::span<const Scalar> last_chart,
                                 std::span<const Scalar> whole) {
  const bool is_same_chart = are_same(last_chart, whole.first(kChartNumbers));
  const std::span<const Scalar> start = whole.subspan(kChartNumbers, kNodeNumbers);
  return *std::find_if(kForms.begin(), kForms.end(), [&](const HermiteForm& form) {
    if (!form.has_own_chart && !is_same_chart) return false;
    if (!form.continues()) return true;
    const std::size_t shared = kNodeNumbers - form.start_count;
    return !before.empty() &&
           are_same(before.last(kNodeNumbers).first(shared), start.first(shared));
  });
}

std::vector<Scalar> stored_numbers(const HermiteForm& form, std::uint64_t chart_place,
                                   std::span<const Scalar> whole) {
  std::vector<Scalar> numbers;
  if (form.has_own_chart) {
    numbers.assign(whole.begin(), whole.begin() + kChartNumbers);
  } else {
    numbers.push_back(static_cast<Scalar>(chart_place));
  }
  const auto rest = whole.last(form.start_count + kNodeNumbers);
  numbers.insert(numbers.end(), rest.begin(), rest.end());
  return numbers;
}

std::vector<Scalar> whole_numbers(const HermiteForm& form, std::span<const Scalar> chart,
                                  std::span<const Scalar> end_of_before,
                                  std::span<const Scalar> stored) {
  std::vector<Scalar> numbers(chart.begin(), chart.end());
  const auto shared = end_of_before.first(kNodeNumbers - form.start_count);
  numbers.insert(numbers.end(), shared.begin(), shared.end());
  const auto own = stored.subspan(form.chart_count());
  numbers.insert(numbers.end(), own.begin(), own.end());
  return numbers;
}

}  // namespace dyop::io_internal
