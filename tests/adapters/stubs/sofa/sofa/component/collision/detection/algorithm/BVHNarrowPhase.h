// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of SOFA as of 2025 with just what the adapter and its tests use.
#pragma once

#include <sofa/core/CollisionModel.h>
#include <sofa/core/collision/DetectionOutput.h>
#include <sofa/core/collision/Intersection.h>

#include <map>
#include <utility>

namespace sofa::component::collision::detection::algorithm {

// The host's class and its bases in one. Its own test finds nothing here, but is counted.
class BVHNarrowPhase {
 public:
  using DetectionOutputMap = std::map<std::pair<core::CollisionModel*, core::CollisionModel*>,
                                      core::collision::DetectionOutputVector*>;

  virtual ~BVHNarrowPhase() {
    for (const auto& entry : m_outputsMap)
      if (entry.second != nullptr) entry.second->release();
  }
  BVHNarrowPhase(const BVHNarrowPhase&) = delete;
  BVHNarrowPhase& operator=(const BVHNarrowPhase&) = delete;
  virtual void setIntersectionMethod(core::collision::Intersection* v) { intersectionMethod = v; }
  virtual void beginNarrowPhase() {
    for (const auto& entry : m_outputsMap)
      if (entry.second != nullptr) entry.second->clear();
  }
  virtual void addCollisionPair(
      const std::pair<core::CollisionModel*, core::CollisionModel*>& /*cmPair*/) {
    ++stub_own_tests;
  }
  core::collision::DetectionOutputVector*& getDetectionOutputs(core::CollisionModel* cm1,
                                                               core::CollisionModel* cm2) {
    return m_outputsMap[{cm1, cm2}];
  }

  int stub_own_tests = 0;

 protected:
  BVHNarrowPhase() = default;
  static bool isSelfCollision(core::CollisionModel* cm1, core::CollisionModel* cm2) {
    return cm1->getContext() == cm2->getContext();
  }

  core::collision::Intersection* intersectionMethod = nullptr;
  DetectionOutputMap m_outputsMap;
};

}  // namespace sofa::component::collision::detection::algorithm
