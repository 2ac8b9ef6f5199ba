// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <tesseract_common/collision_margin_data.h>
#include <tesseract_common/eigen_types.h>
#include <tesseract_geometry/geometry.h>

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace tesseract_collision {

using CollisionShapesConst = std::vector<tesseract_geometry::Geometry::ConstPtr>;
using CollisionMarginData = tesseract_common::CollisionMarginData;
using CollisionMarginPairData = tesseract_common::CollisionMarginPairData;
using CollisionMarginPairOverrideType = tesseract_common::CollisionMarginPairOverrideType;

enum class ContinuousCollisionType { CCType_None, CCType_Time0, CCType_Time1, CCType_Between };

enum class ContactTestType { FIRST = 0, CLOSEST = 1, ALL = 2, LIMITED = 3 };

struct ContactResult {
  double distance{std::numeric_limits<double>::max()};
  std::array<int, 2> type_id{0, 0};
  std::array<std::string, 2> link_names;
  std::array<int, 2> shape_id{-1, -1};
  std::array<int, 2> subshape_id{-1, -1};
  std::array<Eigen::Vector3d, 2> nearest_points{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<Eigen::Vector3d, 2> nearest_points_local{Eigen::Vector3d::Zero(),
                                                      Eigen::Vector3d::Zero()};
  std::array<Eigen::Isometry3d, 2> transform{Eigen::Isometry3d::Identity(),
                                             Eigen::Isometry3d::Identity()};
  Eigen::Vector3d normal{Eigen::Vector3d::Zero()};
  std::array<double, 2> cc_time{-1, -1};
  std::array<ContinuousCollisionType, 2> cc_type{ContinuousCollisionType::CCType_None,
                                                 ContinuousCollisionType::CCType_None};
  std::array<Eigen::Isometry3d, 2> cc_transform{Eigen::Isometry3d::Identity(),
                                                Eigen::Isometry3d::Identity()};
  bool single_contact_point{false};
};

using ContactResultVector = tesseract_common::AlignedVector<ContactResult>;

class ContactResultMap {
 public:
  using KeyType = std::pair<std::string, std::string>;
  using ContainerType = tesseract_common::AlignedMap<KeyType, ContactResultVector>;
  ContactResult& addContactResult(const KeyType& key, ContactResult result) {
    data_[key].push_back(std::move(result));
    return data_[key].back();
  }
  long count() const {
    long sum = 0;
    for (const auto& entry : data_) sum += long(entry.second.size());
    return sum;
  }
  bool empty() const { return count() == 0; }
  const ContactResultVector& at(const KeyType& key) const { return data_.at(key); }

 private:
  ContainerType data_;
};

using IsContactResultValidFn = std::function<bool(const ContactResult&)>;

struct ContactRequest {
  ContactTestType type = ContactTestType::ALL;
  bool calculate_penetration = true;
  bool calculate_distance = true;
  long contact_limit = 0;
  IsContactResultValidFn is_valid = nullptr;
  ContactRequest(ContactTestType type_ = ContactTestType::ALL) : type(type_) {}
};

}  // namespace tesseract_collision
