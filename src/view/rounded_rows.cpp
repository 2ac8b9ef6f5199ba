// SPDX-License-Identifier: BSD-3-Clause
#include "view/rounded_rows.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "dyop/core/error.h"

namespace dyop::view_internal {
namespace {

constexpr Scalar kPlaceStep = 0x1p-26;    // of the smallest radius
constexpr Scalar kContactStep = 0x1p-18;  // of the smallest radius
constexpr Scalar kImpulseStep = 0x1p-10;  // of an ordinary impulse
// A step is zigzag-coded in 32 bits, of which the largest value says that the next large one counts.
constexpr Scalar kMostSteps = 0x1p30;
constexpr std::uint32_t kIsLarge = std::numeric_limits<std::uint32_t>::max();
// Bits dropped from single precision in bounds of gaps: 11 digits are left, or 5 where a gap was not
// measured.
constexpr int kBoundBits = 12;
constexpr int kLooseBits = 18;
constexpr std::uint8_t kHasUpper = 64;

Scalar smallest_radius(const PageScene& scene) {
  Scalar smallest = kInfinity;
  for (const PageBody& body : scene.bodies) {
    const Scalar radius = body.shape->bounding_radius();
    if (body.kind != BodyKind::Static && radius > 0) smallest = std::min(smallest, radius);
  }
  return std::isfinite(smallest) ? smallest : 1;
}

Scalar median_impulse(const std::vector<PageContact>& contacts) {
  std::vector<Scalar> sizes;
  for (const PageContact& contact : contacts) {
    const Scalar size = contact.impulse_W.norm();
    if (size > 0) sizes.push_back(size);
  }
  if (sizes.empty()) return 1;
  const auto middle = sizes.begin() + std::ptrdiff_t(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

// In single precision of few digits.
float bound_below(Scalar x, int dropped) {
  float rounded = float(x);
  if (Scalar(rounded) > x) rounded = std::nextafter(rounded, -std::numeric_limits<float>::max());
  auto bits = std::bit_cast<std::uint32_t>(rounded);
  const std::uint32_t low = (1u << dropped) - 1;
  if (rounded < 0 && (bits & low) != 0) bits += low + 1;  // dropping digits would raise it
  return std::bit_cast<float>(bits & ~low);
}

float bound_above(Scalar x) {
  return -bound_below(-x, kBoundBits);
}

std::uint32_t digits_of(float bound) {
  return std::bit_cast<std::uint32_t>(bound) >> kBoundBits;
}

// A whole number, small where the one before it was nearly the same.
std::uint32_t step_between(std::uint32_t from, std::uint32_t to) {
  const auto step = std::int32_t(to - from);
  return std::uint32_t(step) << 1 ^ std::uint32_t(step >> 31);
}

// Places of a list, each pair's together and in the order of the list, and how many each pair has.
template <typename Row>
struct ByPair {
  std::vector<std::size_t> order;
  std::vector<std::uint32_t> a, b, count;

  explicit ByPair(const std::vector<Row>& rows) : order(rows.size()) {
    // Names stand beside the places: looking them up in the rows would take longer than sorting.
    std::vector<std::pair<std::uint64_t, std::size_t>> named(rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      named[k] = {std::uint64_t{rows[k].a.slot} << 32 | rows[k].b.slot, k};
    }
    std::ranges::sort(named);
    for (std::size_t k = 0; k < named.size(); ++k) {
      const auto [name, row] = named[k];
      order[k] = row;
      if (k == 0 || name != named[k - 1].first) {
        a.push_back(rows[row].a.slot);
        b.push_back(rows[row].b.slot);
        count.push_back(0);
      }
      ++count.back();
    }
  }

  void add_to(ColumnBlock& block, const std::string& name) const {
    block.add(name + ".a", std::span(a));
    block.add(name + ".b", std::span(b));
    block.add(name + ".count", std::span(count));
  }
};

}  // namespace

Rounding Rounding::of(const PageScene& scene, const TimeInterval& time, const PageSpan& span) {
  // A power of two, so that many a number of a scene file is hit exactly.
  const Scalar radius = std::exp2(std::floor(std::log2(smallest_radius(scene))));
  const Scalar frame = time.length() / Scalar(std::max<std::size_t>(1, span.frames.size()));
  Rounding rounding;
  rounding.place = kPlaceStep * radius;
  rounding.velocity = frame > 0 ? rounding.place / frame : rounding.place;
  rounding.contact = kContactStep * radius;
  rounding.impulse = kImpulseStep * median_impulse(span.contacts);
  return rounding;
}

Scalar Rounding::turn(Scalar radius) const {
  return radius > 0 ? place / radius : kPlaceStep;
}

Scalar Rounding::velocity_over(Scalar length) const {
  return length > 0 ? std::min(velocity, place / length) : velocity;
}

Scalar RoundedColumn::add(Scalar value, Scalar expected, Scalar step) {
  const Scalar steps = std::round((value - expected) / step);
  if (!(std::abs(steps) < kMostSteps)) {
    steps_.push_back(kIsLarge);
    large_.push_back(value);
    return value;
  }
  const auto whole = std::int32_t(steps);
  steps_.push_back(std::uint32_t(whole) << 1 ^ std::uint32_t(whole >> 31));
  return expected + step * steps;
}

void RoundedColumn::add_to(ColumnBlock& block, const std::string& name) const {
  block.add(name, std::span(steps_));
  if (!large_.empty()) block.add(name + "!", std::span(large_));
}

Vector3 RoundedVectors::add(const Vector3& value, const Vector3& expected, Scalar step) {
  return {axes_[0].add(value.x(), expected.x(), step), axes_[1].add(value.y(), expected.y(), step),
          axes_[2].add(value.z(), expected.z(), step)};
}

void RoundedVectors::add_to(ColumnBlock& block, const std::string& name) const {
  for (int axis = 0; axis < 3; ++axis) axes_[axis].add_to(block, name + "xyz"[axis]);
}

void TimeTable::sort() {
  std::ranges::sort(times_);
  times_.erase(std::unique(times_.begin(), times_.end()), times_.end());
}

std::uint32_t TimeTable::at(Scalar t) const {
  return std::uint32_t(std::ranges::lower_bound(times_, t) - times_.begin());
}

void TimeTable::add_to(ColumnBlock& block) const {
  block.add("times", std::span(times_));
}

void add_rounded_gaps(ColumnBlock& block, const std::vector<PageGap>& gaps,
                      const Rounding& rounding, const TimeTable& times) {
  const ByPair pairs(gaps);
  pairs.add_to(block, "gap_pair");
  std::vector<std::uint32_t> t;
  std::vector<std::uint8_t> flags;
  std::vector<std::uint32_t> lower, upper;
  std::uint32_t last_lower = 0;
  RoundedVectors pa, pb, pivot;
  // What was last read of the pair; a pair begins where the one before it was.
  Vector3 place = Vector3::Zero();
  Vector3 way = Vector3::Zero();
  Vector3 middle = Vector3::Zero();
  for (const std::size_t k : pairs.order) {
    const PageGap& gap = gaps[k];
    const bool has_upper = std::isfinite(gap.upper);
    t.push_back(times.at(gap.t));
    flags.push_back(std::uint8_t((gap.is_resting ? 1 : 0) | (gap.witness_W ? 2 : 0) |
                                 (gap.pivot_W ? 4 : 0) | (has_upper ? kHasUpper : 0) |
                                 (gap.proof ? 1 + int(*gap.proof) : 0) << 3));
    const float below = bound_below(gap.lower, has_upper ? kBoundBits : kLooseBits);
    const float above = bound_above(gap.upper);
    lower.push_back(step_between(last_lower, digits_of(below)));
    last_lower = digits_of(below);
    if (has_upper) upper.push_back(step_between(last_lower, digits_of(above)));
    if (gap.witness_W) {
      place = pa.add(gap.witness_W->first, place, rounding.place);
      const Scalar width = std::isfinite(above) && above > 0 ? Scalar(above) : rounding.contact;
      // In units of the width, so that the narrowest gap keeps its direction.
      way =
          pb.add((gap.witness_W->second - gap.witness_W->first) / width, way, Rounding::kDirection);
    }
    const Vector3 origin = gap.witness_W ? place : Vector3(Vector3::Zero());
    if (gap.pivot_W) middle = pivot.add(*gap.pivot_W - origin, middle, rounding.contact);
  }
  block.add("gap.t", std::span(t));
  block.add("gap.flags", std::span(flags));
  block.add("gap.lower", std::span(lower));
  block.add("gap.upper", std::span(upper));
  pa.add_to(block, "gap.pa");
  pb.add_to(block, "gap.pb");
  pivot.add_to(block, "gap.pivot");
}

void add_rounded_contacts(ColumnBlock& block, const std::vector<PageContact>& contacts,
                          const Rounding& rounding, const TimeTable& times) {
  const ByPair pairs(contacts);
  pairs.add_to(block, "contact_pair");
  std::vector<std::uint32_t> begin, end;
  std::vector<std::uint8_t> resting;
  RoundedVectors p, normal, impulse;
  struct Read {
    Vector3 p = Vector3::Zero();
    Vector3 normal = Vector3::Zero();
    Vector3 impulse = Vector3::Zero();
  };
  // The contacts of the pair over the frame before and over this one: the first is expected where
  // the first was, and so on.
  std::vector<Read> before, now;
  const PageContact* last = nullptr;
  for (const std::size_t k : pairs.order) {
    const PageContact& contact = contacts[k];
    const bool is_same = last != nullptr && last->a == contact.a && last->b == contact.b &&
                         last->interval.begin == contact.interval.begin;
    if (!is_same) before = std::exchange(now, {});
    last = &contact;
    const Read expected = now.size() < before.size() ? before[now.size()]
                          : !now.empty()             ? now.back()
                          : !before.empty()          ? before.back()
                                                     : Read();
    begin.push_back(times.at(contact.interval.begin));
    end.push_back(times.at(contact.interval.end) - begin.back());
    resting.push_back(contact.is_resting ? 1 : 0);
    now.push_back({p.add(contact.p_WC, expected.p, rounding.contact),
                   normal.add(contact.nhat_AB_W, expected.normal, Rounding::kDirection),
                   impulse.add(contact.impulse_W, expected.impulse, rounding.impulse)});
  }
  block.add("contact.begin", std::span(begin));
  block.add("contact.end", std::span(end));
  block.add("contact.resting", std::span(resting));
  p.add_to(block, "contact.p");
  normal.add_to(block, "contact.normal");
  impulse.add_to(block, "contact.impulse");
}

}  // namespace dyop::view_internal
