// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of SOFA as of 2025 with just what the adapter and its tests use.
#pragma once

#include <sofa/core/CollisionModel.h>

#include <cstdint>
#include <utility>

namespace sofa::core::collision {

class DetectionOutput {
 public:
  std::pair<core::CollisionElementIterator, core::CollisionElementIterator> elem;
  typedef std::int64_t ContactId;
  ContactId id = 0;
  type::Vec3 point[2];
  type::Vec3 normal;
  double value = 0;
  double deltaT = 0;
};

class DetectionOutputVector {
 protected:
  virtual ~DetectionOutputVector() {}

 public:
  virtual void clear() = 0;
  virtual unsigned int size() const = 0;
  virtual void release() { delete this; }
};

template <class CM1, class CM2>
class TDetectionOutputVector : public DetectionOutputVector,
                               public sofa::type::vector<DetectionOutput> {
 public:
  typedef sofa::type::vector<DetectionOutput> Vector;
  ~TDetectionOutputVector() override {}
  void clear() override { Vector::clear(); }
  unsigned int size() const override { return static_cast<unsigned int>(Vector::size()); }
};

}  // namespace sofa::core::collision
