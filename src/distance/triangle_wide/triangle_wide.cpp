// SPDX-License-Identifier: BSD-3-Clause
#include "distance/triangle_wide/triangle_wide.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/tolerance.h"
#include "distance/triangle_wide/triangle_batch.h"
#include "dyop/core/error.h"
#include "dyop/distance/triangle_distance.h"

namespace dyop::distance_internal {

extern const TriangleWideKernels triangle_wide_baseline;
#ifdef DYOP_HAS_X86_KERNELS
extern const TriangleWideKernels triangle_wide_avx2;
extern const TriangleWideKernels triangle_wide_avx512;
#endif

const TriangleWideKernels& triangle_wide_kernels(InstructionSet set) {
#ifdef DYOP_HAS_X86_KERNELS
  if (set == InstructionSet::Avx512) return triangle_wide_avx512;
  if (set == InstructionSet::Avx2) return triangle_wide_avx2;
#endif
  (void)set;
  return triangle_wide_baseline;
}

// These limits are built into the thorough kernel.
static_assert(kTriangleWalkLimit == 3 && kTrianglePiercingSteps == 2);

const TriangleConstants& triangle_constants() {
  static constexpr TriangleConstants kConstants{
      kTriangleRelativeSlack, kTriangleSizeSlack,   kTriangleNoise,
      kSmallestTriangleSize,  kLargestTriangleSize, kSmallestSquaredDirection,
      kSmallestFacetSquare,   kLargestFacetSquare,  kTriangleParallelSquare,
      kTriangleFlatSquare,    kTriangleContactGap,  kTriangleFarRatio};
  return kConstants;
}

}  // namespace dyop::distance_internal

namespace dyop {
namespace distance_internal {
namespace {

constexpr std::size_t kBlockWidth = kTriangleBlockWidth;

// Number of blocks passed to a kernel at a time: they fit the first-level cache.
constexpr std::size_t kRun = 8;

void copy_triangle(const TriangleBlock& source, std::size_t from, TriangleBlock& block,
                   std::size_t to) {
  for (std::size_t k = 0; k < 9; ++k) block.at[k][to] = source.at[k][from];
}

void copy_answer(const TriangleDistanceBlock& source, std::size_t from,
                 TriangleDistanceBlock& block, std::size_t to) {
  block.lower[to] = source.lower[from];
  block.upper[to] = source.upper[from];
  for (std::size_t k = 0; k < 3; ++k) {
    block.p_a[k][to] = source.p_a[k][from];
    block.p_b[k][to] = source.p_b[k][from];
    block.nhat_AB[k][to] = source.nhat_AB[k][from];
  }
  block.place_a[to] = source.place_a[from];
  block.place_b[to] = source.place_b[from];
  block.is_overlapping[to] = source.is_overlapping[from];
}

unsigned char place_of(const Feature& feature) {
  unsigned char place = 0;
  while (place < kFaceCode && feature_of_place(place) != feature) ++place;
  return place;
}

void solve_alone(const TriangleBlock& a, const TriangleBlock& b, TriangleDistanceBlock& block,
                 std::size_t n) {
  const TriangleDistance d = triangle_distance(triangle_at(a, n), triangle_at(b, n));
  block.lower[n] = d.lower;
  block.upper[n] = d.upper;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    block.p_a[k][n] = d.p_a[axis];
    block.p_b[k][n] = d.p_b[axis];
    block.nhat_AB[k][n] = d.nhat_AB[axis];
  }
  block.place_a[n] = place_of(d.feature_a);
  block.place_b[n] = place_of(d.feature_b);
  block.is_overlapping[n] = d.is_overlapping ? 1 : 0;
}

// Solves blocks of pairs. Pairs that the quick kernel leaves open wait in blocks of their own until
// these are full, so that the thorough kernel has work for all lanes.
class BatchSolver {
 public:
  BatchSolver(const TriangleBlocks& a, const TriangleBlocks& b, TriangleDistanceBlocks& answers,
              InstructionSet set)
      : a_(a.blocks().data()),
        b_(b.blocks().data()),
        answers_(answers.blocks().data()),
        count_(a.size()),
        kernels_(triangle_wide_kernels(set)) {}

  void solve() {
    const std::size_t block_count = (count_ + kBlockWidth - 1) / kBlockWidth;
    for (std::size_t first = 0; first < block_count; first += kRun) {
      solve(first, std::min(kRun, block_count - first));
    }
    flush();
  }

 private:
  void solve(std::size_t first, std::size_t block_count) {
    unsigned char decided[kRun];
    run(kernels_.quick, first, block_count, decided);
    int open_count = 0;
    for (std::size_t n = 0; n < block_count; ++n)
      open_count += kTriangleBlockWidth - std::popcount(decided[n]);
    if (open_count == 0) return;
    // If most pairs are open, running all of them again is cheaper than copying.
    const bool is_most = 2 * open_count > static_cast<int>(block_count) * kTriangleBlockWidth;
    if (is_most) run(kernels_.thorough, first, block_count, decided);
    for (std::size_t block = 0; block < block_count; ++block) {
      for (unsigned open = ~unsigned{decided[block]} & 0xff; open != 0; open &= open - 1) {
        const std::size_t n =
            kBlockWidth * (first + block) + static_cast<std::size_t>(std::countr_zero(open));
        if (n >= count_) break;
        if (is_most) {
          solve_alone(a_[n / kBlockWidth], b_[n / kBlockWidth], answers_[n / kBlockWidth],
                      n % kBlockWidth);
        } else {
          enqueue(n);
        }
      }
    }
  }

  void run(TriangleWideKernel kernel, std::size_t first, std::size_t block_count,
           unsigned char* decided) {
    kernel(a_ + first, b_ + first, answers_ + first, static_cast<int>(block_count),
           triangle_constants(), decided);
  }

  void enqueue(std::size_t n) {
    const std::size_t to = waiting_count_;
    waiting_[to] = n;
    copy_triangle(a_[n / kBlockWidth], n % kBlockWidth, waiting_a_[to / kBlockWidth],
                  to % kBlockWidth);
    copy_triangle(b_[n / kBlockWidth], n % kBlockWidth, waiting_b_[to / kBlockWidth],
                  to % kBlockWidth);
    if (++waiting_count_ == kRun * kBlockWidth) flush();
  }

  void flush() {
    const std::size_t block_count = (waiting_count_ + kBlockWidth - 1) / kBlockWidth;
    unsigned char decided[kRun];
    kernels_.thorough(waiting_a_, waiting_b_, waiting_answers_, static_cast<int>(block_count),
                      triangle_constants(), decided);
    for (std::size_t k = 0; k < waiting_count_; ++k) {
      const std::size_t n = waiting_[k];
      if ((decided[k / kBlockWidth] >> k % kBlockWidth & 1) != 0) {
        copy_answer(waiting_answers_[k / kBlockWidth], k % kBlockWidth, answers_[n / kBlockWidth],
                    n % kBlockWidth);
      } else {
        solve_alone(a_[n / kBlockWidth], b_[n / kBlockWidth], answers_[n / kBlockWidth],
                    n % kBlockWidth);
      }
    }
    waiting_count_ = 0;
  }

  const TriangleBlock* a_;
  const TriangleBlock* b_;
  TriangleDistanceBlock* answers_;
  std::size_t count_;
  const TriangleWideKernels& kernels_;
  std::size_t waiting_count_ = 0;
  std::size_t waiting_[kRun * kBlockWidth];
  TriangleBlock waiting_a_[kRun] = {};
  TriangleBlock waiting_b_[kRun] = {};
  TriangleDistanceBlock waiting_answers_[kRun];
};

}  // namespace

void triangle_distances(const TriangleBlocks& a, const TriangleBlocks& b, InstructionSet set,
                        TriangleDistanceBlocks& answers) {
  DYOP_REQUIRE(a.size() == b.size(), a.size(), " triangles against ", b.size());
  answers.resize(a.size());
  BatchSolver(a, b, answers, set).solve();
}

}  // namespace distance_internal

TriangleBlocks::TriangleBlocks(std::size_t count)
    : count_(count),
      blocks_((count + distance_internal::kBlockWidth - 1) / distance_internal::kBlockWidth) {}

Triangle TriangleBlocks::operator[](std::size_t n) const {
  return distance_internal::triangle_at(blocks_[n / distance_internal::kBlockWidth],
                                        n % distance_internal::kBlockWidth);
}

void TriangleBlocks::set(std::size_t n, const Triangle& triangle) {
  distance_internal::set_triangle(blocks_[n / distance_internal::kBlockWidth],
                                  n % distance_internal::kBlockWidth, triangle);
}

void TriangleDistanceBlocks::resize(std::size_t count) {
  count_ = count;
  blocks_.resize((count + distance_internal::kBlockWidth - 1) / distance_internal::kBlockWidth);
}

TriangleDistance TriangleDistanceBlocks::operator[](std::size_t n) const {
  return distance_internal::answer_at(blocks_[n / distance_internal::kBlockWidth],
                                      n % distance_internal::kBlockWidth);
}

void triangle_distances(const TriangleBlocks& a, const TriangleBlocks& b,
                        TriangleDistanceBlocks& answers) {
  distance_internal::triangle_distances(a, b, core_internal::best_instruction_set(), answers);
}

namespace distance_internal {
namespace {

// From this number of triangles on, the wide kernel is faster than one call each.
constexpr int kFewest = 3;

TriangleSlab slab_of(const Triangle& a, const Vector3& direction, Scalar cutoff) {
  TriangleSlab slab;
  const Scalar squared = direction.squaredNorm();
  slab.start = 0;
  slab.largest = 0;
  for (std::size_t k = 1; k < 3; ++k) {
    const Vector3 edge = a[k] - a[0];
    slab.start = std::max(slab.start, direction.dot(edge));
    slab.largest = std::max(slab.largest, edge.cwiseAbs().maxCoeff());
  }
  for (int k = 0; k < 3; ++k) {
    slab.origin[k] = a[0][k];
    slab.direction[k] = direction[k];
  }
  slab.noise = kTriangleSlabNoise * direction.cwiseAbs().sum();
  // Directions so long or short that products leave the range prove nothing; nor does NaN.
  constexpr Scalar kLongest = kLargestTriangleSize * kLargestTriangleSize;
  const bool is_usable = squared <= kLongest && squared * kLongest >= 1;
  const Scalar underflow = 16 * std::numeric_limits<Scalar>::denorm_min();
  slab.limit =
      is_usable ? cutoff * std::sqrt(squared) * (1 + kTriangleSlabNoise) + underflow : kInfinity;
  return slab;
}

// Keeps the nearest of the triangles offered, in ascending order of numbers.
struct Nearest {
  std::optional<NearestTriangle> best;
  Scalar cutoff;

  void offer(int number, const TriangleDistance& d) {
    if (!(d.upper < cutoff)) return;
    cutoff = d.upper;
    best = {number, d};
  }
};

}  // namespace

std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction, Scalar cutoff,
                                                InstructionSet set) {
  DYOP_REQUIRE(count >= 0 && count <= kTriangleBlockWidth, "a block of ", count, " triangles");
  const TriangleWideKernels& kernels = triangle_wide_kernels(set);
  unsigned left = kernels.slab(block, slab_of(a, direction, cutoff)) & ((1U << count) - 1);
  if (left == 0) return std::nullopt;
  TriangleBlock all_a;
  TriangleDistanceBlock answers;
  unsigned char decided = 0;
  if (std::popcount(left) >= kFewest) {
    for (std::size_t n = 0; n < kTriangleBlockWidth; ++n) set_triangle(all_a, n, a);
    kernels.quick(&all_a, &block, &answers, 1, triangle_constants(), &decided);
  }
  Nearest nearest{std::nullopt, cutoff};
  for (; left != 0; left &= left - 1) {
    const int number = std::countr_zero(left);
    const auto n = static_cast<std::size_t>(number);
    nearest.offer(number, (decided >> number & 1) != 0
                              ? answer_at(answers, n)
                              : triangle_distance(a, triangle_at(block, n)));
  }
  return nearest.best;
}

}  // namespace distance_internal

std::optional<NearestTriangle> nearest_triangle(const Triangle& a, const TriangleBlock& block,
                                                int count, const Vector3& direction,
                                                Scalar cutoff) {
  return distance_internal::nearest_triangle(a, block, count, direction, cutoff,
                                             core_internal::best_instruction_set());
}

}  // namespace dyop
