// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <tesseract_collision/core/types.h>
#include <tesseract_common/contact_allowed_validator.h>

#include <memory>
#include <string>
#include <vector>

namespace tesseract_collision {

class ContinuousContactManager {
 public:
  using UPtr = std::unique_ptr<ContinuousContactManager>;

  ContinuousContactManager() = default;
  virtual ~ContinuousContactManager() = default;
  ContinuousContactManager(const ContinuousContactManager&) = delete;
  ContinuousContactManager& operator=(const ContinuousContactManager&) = delete;

  virtual std::string getName() const = 0;
  virtual ContinuousContactManager::UPtr clone() const = 0;
  virtual bool addCollisionObject(const std::string& name, const int& mask_id,
                                  const CollisionShapesConst& shapes,
                                  const tesseract_common::VectorIsometry3d& shape_poses,
                                  bool enabled = true) = 0;
  virtual const CollisionShapesConst& getCollisionObjectGeometries(
      const std::string& name) const = 0;
  virtual const tesseract_common::VectorIsometry3d& getCollisionObjectGeometriesTransforms(
      const std::string& name) const = 0;
  virtual bool hasCollisionObject(const std::string& name) const = 0;
  virtual bool removeCollisionObject(const std::string& name) = 0;
  virtual bool enableCollisionObject(const std::string& name) = 0;
  virtual bool disableCollisionObject(const std::string& name) = 0;
  virtual bool isCollisionObjectEnabled(const std::string& name) const = 0;
  virtual void setCollisionObjectsTransform(const std::string& name,
                                            const Eigen::Isometry3d& pose) = 0;
  virtual void setCollisionObjectsTransform(const std::vector<std::string>& names,
                                            const tesseract_common::VectorIsometry3d& poses) = 0;
  virtual void setCollisionObjectsTransform(const tesseract_common::TransformMap& transforms) = 0;
  virtual void setCollisionObjectsTransform(const std::string& name, const Eigen::Isometry3d& pose1,
                                            const Eigen::Isometry3d& pose2) = 0;
  virtual void setCollisionObjectsTransform(const std::vector<std::string>& names,
                                            const tesseract_common::VectorIsometry3d& pose1,
                                            const tesseract_common::VectorIsometry3d& pose2) = 0;
  virtual void setCollisionObjectsTransform(const tesseract_common::TransformMap& pose1,
                                            const tesseract_common::TransformMap& pose2) = 0;
  virtual const std::vector<std::string>& getCollisionObjects() const = 0;
  virtual void setActiveCollisionObjects(const std::vector<std::string>& names) = 0;
  virtual const std::vector<std::string>& getActiveCollisionObjects() const = 0;
  virtual void setCollisionMarginData(CollisionMarginData collision_margin_data) = 0;
  virtual const CollisionMarginData& getCollisionMarginData() const = 0;
  virtual void setCollisionMarginPairData(
      const CollisionMarginPairData& pair_margin_data,
      CollisionMarginPairOverrideType override_type = CollisionMarginPairOverrideType::REPLACE) = 0;
  virtual void setDefaultCollisionMargin(double default_collision_margin) = 0;
  virtual void setCollisionMarginPair(const std::string& name1, const std::string& name2,
                                      double collision_margin) = 0;
  virtual void incrementCollisionMargin(double increment) = 0;
  virtual void setContactAllowedValidator(
      std::shared_ptr<const tesseract_common::ContactAllowedValidator> validator) = 0;
  virtual std::shared_ptr<const tesseract_common::ContactAllowedValidator>
  getContactAllowedValidator() const = 0;
  virtual void contactTest(ContactResultMap& collisions, const ContactRequest& request) = 0;
};

}  // namespace tesseract_collision
