// SPDX-License-Identifier: BSD-3-Clause

// Prints a hash of what the wide types and the wide kernels compute on fixed random inputs. The
// lines must be the same for every processor and every backend of core/simd.h: tests/aarch64.sh
// compares them. Links nothing but the kernels, so that it can be compiled for any processor by
// hand.

#include <bit>
#include <cstdint>
#include <cstdio>

#include "core/simd.h"
#include "core/simd_pair.h"
#include "distance/triangle_wide/triangle_batch.h"
#include "distance/triangle_wide/triangle_wide.h"
#include "hierarchy/box_gaps.h"
#include "toi/rigid/box_steps.h"

namespace {

using namespace dyop;
using namespace dyop::core_internal;
using namespace dyop::hierarchy_internal;
using namespace dyop::distance_internal;
using namespace dyop::toi_internal;

/// FNV-1a over the bits of numbers. The sign and payload of NaN belong to the processor.
struct Hash {
  std::uint64_t value = 0xcbf29ce484222325;

  void add(std::uint64_t bits) {
    for (int k = 0; k < 64; k += 8) value = (value ^ ((bits >> k) & 255)) * 0x100000001b3;
  }
  void add(double x) { add(x != x ? ~std::uint64_t{0} : std::bit_cast<std::uint64_t>(x)); }
  template <std::size_t n>
  void add(const double (&x)[n]) {
    for (const double number : x) add(number);
  }
};

/// Whole-number arithmetic only, so that every processor draws the same inputs.
struct Random {
  std::uint64_t state = 1;

  std::uint64_t bits() {  // splitmix64
    std::uint64_t z = (state += 0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  /// Uniform in [low, high).
  double number(double low, double high) {
    return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53);
  }
  int below(int n) { return static_cast<int>(bits() % static_cast<std::uint64_t>(n)); }
  /// Any pattern of bits, and often a special number.
  double any() {
    static constexpr double kSpecial[] = {
        0.0, -0.0, 1.0, -1.0, __builtin_inf(), -__builtin_inf(), 0x1p-1074, 0x1.fp1023};
    const int n = below(16);
    return n < 8 ? kSpecial[n] : std::bit_cast<double>(bits());
  }
  void vector(double size, double* v) {
    for (int i = 0; i < 3; ++i) v[i] = number(-size, size);
  }
};

/// Two orthonormal axes by Gram-Schmidt, the third by the vector product.
void random_axes(Random& random, double (*axes)[3]) {
  const auto normalize = [](double* v) {
    const double length = __builtin_sqrt((v[0] * v[0] + v[1] * v[1]) + v[2] * v[2]);
    for (int i = 0; i < 3; ++i) v[i] = v[i] / length;
  };
  random.vector(1, axes[0]);
  random.vector(1, axes[1]);
  normalize(axes[0]);
  const double along = core_internal::dot(axes[0], axes[1]);
  for (int i = 0; i < 3; ++i) axes[1][i] = axes[1][i] - along * axes[0][i];
  normalize(axes[1]);
  paper_internal::cross(axes[0], axes[1], axes[2]);
  if (random.below(4) == 0) {  // parallel to the frame
    for (int k = 0; k < 3; ++k) {
      for (int i = 0; i < 3; ++i) axes[k][i] = k == i ? 1 : 0;
    }
  }
}

struct BoxCase {
  float rows[15][kGroupWidth];
  GroupRows group;
  FacingPiece piece{};
  int count;

  BoxCase(Random& random, double size) : group{rows, 4 * size, {}} {
    for (int n = 0; n < kGroupWidth; ++n) {
      double axes[3][3];
      random_axes(random, axes);
      for (int i = 0; i < 3; ++i) {
        rows[i][n] = static_cast<float>(random.number(-0.25, 0.25));
        for (int k = 0; k < 3; ++k) rows[kGroupAxes + 3 * k + i][n] = float(axes[k][i]);
        rows[kGroupHalfExtents + i][n] =
            random.below(8) == 0 ? 0.0f : static_cast<float>(random.number(0, 0.25));
      }
    }
    FacingBox& box = piece.box;
    random.vector(4 * size, box.center);
    random_axes(random, box.axes);
    for (double& h : box.half_extents) h = random.number(0, size);
    count = 1 + random.below(kGroupWidth);
  }
  BoxCase(const BoxCase&) = delete;
};

double norm(const double* v) {
  return __builtin_sqrt(core_internal::dot(v, v));
}

FacingMotion random_motion(Random& random, BoxCase& c) {
  FacingMotion m{};
  for (int i = 0; i < 3; ++i) m.origin[i] = c.piece.box.center[i];
  random.vector(1, c.piece.from_origin);
  c.piece.half_diagonal = norm(c.piece.box.half_extents);
  c.piece.radius = norm(c.piece.from_origin) + c.piece.half_diagonal;
  random.vector(1, m.velocity);
  const double rate = random.below(4) == 0 ? 0 : random.number(0, 4);
  random.vector(rate, m.turning);
  random.vector(rate, m.other_turning);
  m.turning_sq = core_internal::dot(m.turning, m.turning);
  m.other_turning_sq = core_internal::dot(m.other_turning, m.other_turning);
  m.angular_speed = __builtin_sqrt(m.turning_sq);
  m.other_angular_speed = __builtin_sqrt(m.other_turning_sq);
  m.largest_turning =
      m.angular_speed > m.other_angular_speed ? m.angular_speed : m.other_angular_speed;
  m.origin_distance = norm(m.origin);
  m.origin_opening = core_internal::dot(m.origin, m.velocity) / m.origin_distance;
  m.remaining = 2;
  m.horizon = random.number(0, 2);
  m.linear_acceleration = random.below(2) == 0 ? 0 : random.number(0, 1);
  m.angular_acceleration = random.below(2) == 0 ? 0 : random.number(0, 1);
  m.linear_speed = norm(m.velocity) + 2 * m.linear_acceleration;
  m.floor = random.number(0, 0.01);
  m.noise = 0x1p-44;
  m.is_steady = rate == 0 && m.linear_acceleration == 0 && m.angular_acceleration == 0;
  return m;
}

void print(const char* what, const Hash& hash, long hits) {
  std::printf("%-16s %016llx %9ld\n", what, static_cast<unsigned long long>(hash.value), hits);
}

void hash_operations() {
  Random random;
  Hash hash;
  long greater = 0;
  for (int n = 0; n < 40000; ++n) {
    double x[8], y[8], out[12][8];
    for (int k = 0; k < 8; ++k) x[k] = random.any(), y[k] = random.any();
    unsigned bits[4] = {0, 0, 0, 0};
    for (int k = 0; k < 8; k += Lanes::kCount) {
      const Lanes a = loaded(x + k), b = loaded(y + k);
      const Lanes results[] = {a + b,
                               a - b,
                               a * b,
                               a / b,
                               larger(a, b),
                               smaller(a, b),
                               magnitude(a),
                               sqrt(a),
                               select(a > b, a, b),
                               tagged(a, n % 16),
                               negated(a),
                               flip_sign(a, b)};
      for (int i = 0; i < 12; ++i) results[i].store(out[i] + k);
      bits[0] |= (a > b).bits() << k;
      bits[1] |= (a >= b).bits() << k;
      bits[2] |= equal(a, b).bits() << k;
      bits[3] |= without((a > b) | equal(a, Lanes(0.0)), b > Lanes(1.0)).bits() << k;
    }
    for (const auto& row : out) hash.add(row);
    for (const unsigned mask : bits) hash.add(std::uint64_t{mask});
    greater += std::popcount(bits[0]);
  }
  print("operations", hash, greater);
}

void hash_pairs() {
  Random random;
  Hash hash;
  long above_count = 0;
  for (int n = 0; n < 100000; ++n) {
    // Braces: the arguments of a function are evaluated in an order of the compiler's choice.
    const LanePair a{random.any(), random.any()}, b{random.any(), random.any()};
    for (const LanePair& x :
         {a + b, a - b, a * b, a / b, -a, larger(a, b), smaller(a, b), low_negated(a),
          high_negated(a), magnitude(a), sqrt(a), swapped(a), lows(a, b), highs(a, b), clamped(a),
          masked(above(a, b), a), selected(equal(a, b), a, b),
          selected(either(above(a, b), is_inside_unit(a)), b, a), tagged(a, n % 16, 3)}) {
      hash.add(x.low());
      hash.add(x.high());
    }
    hash.add(static_cast<std::uint64_t>(bits(above(a, b))));
    above_count += std::popcount(static_cast<unsigned>(bits(above(a, b))));
  }
  print("pairs", hash, above_count);
}

void hash_boxes() {
  Random random;
  Hash gaps_hash, group_hash, one_hash;
  long apart = 0, far = 0, finite = 0;
  const BoxGapsKernel box_gaps = box_gaps_kernel(InstructionSet::Baseline);
  const BoxStepsKernels box_steps = box_steps_kernels(InstructionSet::Baseline);
  for (int n = 0; n < 125000; ++n) {  // a million boxes
    static constexpr double kSizes[] = {1e-4, 0.1, 1, 1, 1, 10, 1e4};
    BoxCase c(random, kSizes[n % 7]);
    double gaps[kGroupWidth];
    box_gaps(c.group, c.count, c.piece.box, 0x1p-44, gaps);
    for (int k = 0; k < c.count; ++k) gaps_hash.add(gaps[k]), apart += gaps[k] > 0;
    if (n % 2 != 0) continue;
    const FacingMotion motion = random_motion(random, c);
    BoxSteps steps;
    box_steps.group(c.group, 0, c.count, c.piece, motion, &steps);
    for (int k = 0; k < c.count; ++k) {
      group_hash.add(steps.time[k]);
      group_hash.add(std::uint64_t{(steps.is_far >> k) & 1});
      far += (steps.is_far >> k) & 1;
    }
    box_steps.one(c.group, c.count - 1, 1, c.piece, motion, &steps);
    one_hash.add(steps.time[c.count - 1]);
    one_hash.add(std::uint64_t{(steps.is_far >> (c.count - 1)) & 1});
    finite += steps.time[c.count - 1] > 0 && steps.time[c.count - 1] < motion.horizon;
  }
  print("box_gaps", gaps_hash, apart);
  print("box_steps.group", group_hash, far);
  print("box_steps.one", one_hash, finite);
}

void fill(Random& random, TriangleBlock& a, TriangleBlock& b) {
  for (int n = 0; n < kTriangleBlockWidth; ++n) {
    const double offset = random.number(0, 1) * random.below(4);
    const bool is_lattice = random.below(2) == 0;  // flat, parallel and touching ones
    for (int row = 0; row < 9; ++row) {
      a.at[row][n] = is_lattice ? random.below(3) : random.number(-1, 1);
      b.at[row][n] = offset + (is_lattice ? random.below(3) : random.number(-1, 1));
    }
    for (int shared = random.below(4); shared > 0; --shared) {  // vertices in common
      for (int k = 0; k < 3; ++k) b.at[3 * shared - 3 + k][n] = a.at[6 - 3 * (shared - 1) + k][n];
    }
  }
}

void hash_triangles(const char* name, bool is_thorough) {
  const TriangleWideKernels& kernels = triangle_wide_kernels(InstructionSet::Baseline);
  Random random;
  Hash hash;
  long decided_count = 0;
  for (int n = 0; n < 20000; ++n) {
    TriangleBlock a, b;
    fill(random, a, b);
    TriangleDistanceBlock answer{};
    unsigned char decided = 0;
    (is_thorough ? kernels.thorough : kernels.quick)(&a, &b, &answer, 1, triangle_constants(),
                                                     &decided);
    hash.add(std::uint64_t{decided});
    for (int k = 0; k < kTriangleBlockWidth; ++k) {
      if ((decided >> k & 1) == 0) continue;
      ++decided_count;
      hash.add(answer.lower[k]);
      hash.add(answer.upper[k]);
      for (int i = 0; i < 3; ++i) {
        hash.add(answer.p_a[i][k]);
        hash.add(answer.p_b[i][k]);
        hash.add(answer.nhat_AB[i][k]);
      }
      hash.add(std::uint64_t{answer.place_a[k]} << 16 | std::uint64_t{answer.place_b[k]} << 8 |
               answer.is_overlapping[k]);
    }
    TriangleSlab slab{{0, 0, 0}, {1, 1, 0}, random.number(-1, 1), 3, 0x1p-48, 1};
    hash.add(std::uint64_t{kernels.slab(b, slab)});
  }
  print(name, hash, decided_count);
}

}  // namespace

int main() {
  hash_operations();
  hash_pairs();
  hash_boxes();
  hash_triangles("triangle quick", false);
  hash_triangles("triangle full", true);
}
