// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of SOFA as of 2025 with just what the adapter and its tests use.
#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace sofa {
using Index = unsigned int;
using Size = unsigned int;
using SReal = double;

namespace type {
using Vec3 = std::array<double, 3>;
template <class T>
using vector = std::vector<T>;
}  // namespace type

namespace defaulttype {
struct Vec3Types {
  using Coord = type::Vec3;
  using VecCoord = type::vector<Coord>;
};
}  // namespace defaulttype
}  // namespace sofa

#define SOFA_CLASS(T, Parent)            \
  static const char* stub_class_name() { \
    return #T;                           \
  }

namespace sofa::core {

class CollisionModel {
 public:
  explicit CollisionModel(std::string name) : name_(std::move(name)) {}
  virtual ~CollisionModel() = default;
  const std::string& getName() const { return name_; }
  bool empty() const { return size == 0; }
  Size getSize() const { return size; }
  virtual bool isSimulated() const { return simulated_; }
  virtual void setSimulated(bool val = true) { simulated_ = val; }
  CollisionModel* getLast() { return this; }
  SReal getContactDistance() const { return contact_distance_; }
  const void* getContext() const { return this; }
  void stub_set_contact_distance(SReal distance) { contact_distance_ = distance; }

 protected:
  Size size = 0;

 private:
  std::string name_;
  bool simulated_ = true;
  SReal contact_distance_ = 0;
};

class CollisionElementIterator {
 public:
  CollisionElementIterator(CollisionModel* cmodel = nullptr, Index cindex = 0)
      : model(cmodel), index(cindex) {}
  CollisionModel* getCollisionModel() const { return model; }
  Index getIndex() const { return index; }

 private:
  CollisionModel* model;
  Index index;
};

}  // namespace sofa::core
