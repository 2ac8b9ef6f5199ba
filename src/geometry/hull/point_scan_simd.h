// SPDX-License-Identifier: BSD-3-Clause
#include "core/simd.h"
#include "geometry/hull/point_scan.h"

// The kernels of point_scan.h for the instruction set that this file is compiled for.
namespace dyop::geometry_internal {
inline namespace DYOP_LANES {

struct ScanDirection {
  Lanes x;
  Lanes y;
  Lanes z;

  DYOP_INLINE explicit ScanDirection(const double* d) : x(d[0]), y(d[1]), z(d[2]) {}
  DYOP_INLINE Lanes along(const ScanBlock& block, int lane) const {
    return x * Lanes::load(block.x + lane) + y * Lanes::load(block.y + lane) +
           z * Lanes::load(block.z + lane);
  }
};

DYOP_INLINE double largest_of(Lanes best) {
  double lanes[Lanes::kCount];
  best.store(lanes);
  double result = lanes[0];
  for (int i = 1; i < Lanes::kCount; ++i) result = lanes[i] > result ? lanes[i] : result;
  return result;
}

static double scan_largest(const ScanBlock* blocks, int count, const double* direction) {
  const ScanDirection d(direction);
  Lanes best = d.along(blocks[0], 0);
  for (int k = 0; k < count; ++k) {
    for (int lane = 0; lane < ScanBlock::kPoints; lane += Lanes::kCount) {
      best = larger(best, d.along(blocks[k], lane));
    }
  }
  return largest_of(best);
}

// The values are kept: looking for the largest among them is cheaper than keeping track of numbers.
// Where it is found is as good as random, so all places are looked at without a branch.
static int scan_farthest(const ScanBlock* blocks, int count, const double* direction,
                         double* largest) {
  const ScanDirection d(direction);
  Lanes values[kScanBlocks * ScanBlock::kPoints / Lanes::kCount];
  constexpr int kParts = ScanBlock::kPoints / Lanes::kCount;
  Lanes best = d.along(blocks[0], 0);
  for (int k = 0; k < count; ++k) {
    for (int part = 0; part < kParts; ++part) {
      const Lanes value = d.along(blocks[k], part * Lanes::kCount);
      values[k * kParts + part] = value;
      best = larger(best, value);
    }
  }
  *largest = largest_of(best);
  const Lanes most(*largest);
  constexpr int kAtOnce = 8;  // blocks, one bit for each point
  for (int first = 0; first < count; first += kAtOnce) {
    unsigned long long found = 0;
    const int end = first + kAtOnce < count ? first + kAtOnce : count;
    for (int i = first * kParts; i < end * kParts; ++i) {
      const unsigned long long bits = (values[i] >= most).bits();
      found |= bits << (i - first * kParts) * Lanes::kCount;
    }
    if (found != 0) return first * ScanBlock::kPoints + __builtin_ctzll(found);
  }
  return 0;
}

}  // namespace DYOP_LANES

extern const ScanKernels DYOP_KERNEL(point_scan);
const ScanKernels DYOP_KERNEL(point_scan){scan_farthest, scan_largest};

}  // namespace dyop::geometry_internal
