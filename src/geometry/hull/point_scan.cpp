// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/hull/point_scan.h"

#include <algorithm>

#include "geometry/hull/quickhull.h"

namespace dyop::geometry_internal {

extern const ScanKernels point_scan_baseline;
#ifdef DYOP_HAS_X86_KERNELS
extern const ScanKernels point_scan_avx2;
extern const ScanKernels point_scan_avx512;
#endif

ScanKernels scan_kernels(core_internal::InstructionSet set) {
#ifdef DYOP_HAS_X86_KERNELS
  if (set == core_internal::InstructionSet::Avx512) return point_scan_avx512;
  if (set == core_internal::InstructionSet::Avx2) return point_scan_avx2;
#endif
  (void)set;
  return point_scan_baseline;
}

PointScan::PointScan(std::span<const Vector3> points, core_internal::InstructionSet set)
    : kernels_(scan_kernels(set)),
      blocks_((points.size() + ScanBlock::kPoints - 1) / ScanBlock::kPoints) {
  for (std::size_t k = 0; k < blocks_.size() * ScanBlock::kPoints; ++k) {
    const Vector3& p = points[std::min(k, points.size() - 1)];
    ScanBlock& block = blocks_[k / ScanBlock::kPoints];
    block.x[k % ScanBlock::kPoints] = p.x();
    block.y[k % ScanBlock::kPoints] = p.y();
    block.z[k % ScanBlock::kPoints] = p.z();
  }
}

template <typename Visit>
void PointScan::for_each_part(const Visit& visit) const {
  constexpr std::size_t kPart = kScanBlocks;
  for (std::size_t first = 0; first < blocks_.size(); first += kPart) {
    visit(&blocks_[first], static_cast<int>(std::min(kPart, blocks_.size() - first)),
          static_cast<std::int32_t>(first * ScanBlock::kPoints));
  }
}

std::int32_t PointScan::farthest(const Vector3& direction) const {
  std::int32_t best = 0;
  Scalar most = -kInfinity;
  for_each_part([&](const ScanBlock* blocks, int count, std::int32_t first) {
    Scalar largest = 0;
    const int place = kernels_.farthest(blocks, count, direction.data(), &largest);
    if (!(largest > most)) return;
    most = largest;
    best = first + place;
  });
  return best;
}

Scalar PointScan::reach(const Vector3& direction) const {
  Scalar most = -kInfinity;
  for_each_part([&](const ScanBlock* blocks, int count, std::int32_t) {
    most = std::max(most, kernels_.largest(blocks, count, direction.data()));
  });
  // A maximum may drop NaN; zero times the direction restores it.
  return most + 0 * direction.sum();
}

}  // namespace dyop::geometry_internal
