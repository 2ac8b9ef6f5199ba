// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace moveit::core {

class LinkModel;

class JointModel {
 public:
  enum JointType { UNKNOWN, REVOLUTE, PRISMATIC, PLANAR, FLOATING, FIXED };

  virtual ~JointModel() = default;
  const std::string& getName() const { return name_; }
  JointType getType() const { return type_; }
  int getFirstVariableIndex() const { return first_variable_index_; }
  const JointModel* getMimic() const { return mimic_; }
  double getMimicOffset() const { return mimic_offset_; }
  double getMimicFactor() const { return mimic_factor_; }
  void setFirstVariableIndex(int index) { first_variable_index_ = index; }
  void setMimic(const JointModel* mimic, double factor, double offset) {
    mimic_ = mimic;
    mimic_factor_ = factor;
    mimic_offset_ = offset;
  }

  virtual unsigned int getStateSpaceDimension() const = 0;
  virtual void interpolate(const double* from, const double* to, const double t,
                           double* state) const = 0;
  virtual void computeTransform(const double* joint_values, Eigen::Isometry3d& transf) const = 0;

 protected:
  JointModel(std::string name, JointType type) : name_(std::move(name)), type_(type) {}

 private:
  std::string name_;
  JointType type_;
  int first_variable_index_ = 0;
  const JointModel* mimic_ = nullptr;
  double mimic_factor_ = 1;
  double mimic_offset_ = 0;
};

class FixedJointModel : public JointModel {
 public:
  explicit FixedJointModel(const std::string& name) : JointModel(name, FIXED) {}
  unsigned int getStateSpaceDimension() const override { return 0; }
  void interpolate(const double*, const double*, const double, double*) const override {}
  void computeTransform(const double*, Eigen::Isometry3d& transf) const override {
    transf = Eigen::Isometry3d::Identity();
  }
};

inline double stub_turn(double from, double to) {
  const double diff = to - from;
  return diff - 2 * std::numbers::pi * std::round(diff / (2 * std::numbers::pi));
}

class RevoluteJointModel : public JointModel {
 public:
  explicit RevoluteJointModel(const std::string& name) : JointModel(name, REVOLUTE) {}
  bool isContinuous() const { return continuous_; }
  void setContinuous(bool flag) { continuous_ = flag; }
  const Eigen::Vector3d& getAxis() const { return axis_; }
  void setAxis(const Eigen::Vector3d& axis) { axis_ = axis.normalized(); }
  unsigned int getStateSpaceDimension() const override { return 1; }
  void interpolate(const double* from, const double* to, const double t,
                   double* state) const override {
    state[0] = from[0] + t * (continuous_ ? stub_turn(from[0], to[0]) : to[0] - from[0]);
  }
  void computeTransform(const double* joint_values, Eigen::Isometry3d& transf) const override {
    transf = Eigen::AngleAxisd(joint_values[0], axis_);
  }

 private:
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();
  bool continuous_ = false;
};

class PrismaticJointModel : public JointModel {
 public:
  explicit PrismaticJointModel(const std::string& name) : JointModel(name, PRISMATIC) {}
  const Eigen::Vector3d& getAxis() const { return axis_; }
  void setAxis(const Eigen::Vector3d& axis) { axis_ = axis.normalized(); }
  unsigned int getStateSpaceDimension() const override { return 1; }
  void interpolate(const double* from, const double* to, const double t,
                   double* state) const override {
    state[0] = from[0] + t * (to[0] - from[0]);
  }
  void computeTransform(const double* joint_values, Eigen::Isometry3d& transf) const override {
    transf = Eigen::Translation3d(joint_values[0] * axis_);
  }

 private:
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();
};

// Variables: x, y, yaw.
class PlanarJointModel : public JointModel {
 public:
  enum MotionModel { HOLONOMIC, DIFF_DRIVE };

  explicit PlanarJointModel(const std::string& name) : JointModel(name, PLANAR) {}
  MotionModel getMotionModel() const { return motion_model_; }
  void setMotionModel(MotionModel model) { motion_model_ = model; }
  unsigned int getStateSpaceDimension() const override { return 3; }
  void interpolate(const double* from, const double* to, const double t,
                   double* state) const override {
    for (int k = 0; k < 2; ++k) state[k] = from[k] + t * (to[k] - from[k]);
    state[2] = from[2] + t * stub_turn(from[2], to[2]);
  }
  void computeTransform(const double* joint_values, Eigen::Isometry3d& transf) const override {
    transf = Eigen::Translation3d(joint_values[0], joint_values[1], 0) *
             Eigen::AngleAxisd(joint_values[2], Eigen::Vector3d::UnitZ());
  }

 private:
  MotionModel motion_model_ = HOLONOMIC;
};

// Variables: x, y, z and the quaternion's x, y, z, w.
class FloatingJointModel : public JointModel {
 public:
  explicit FloatingJointModel(const std::string& name) : JointModel(name, FLOATING) {}
  unsigned int getStateSpaceDimension() const override { return 6; }
  void interpolate(const double* from, const double* to, const double t,
                   double* state) const override {
    const Eigen::Quaterniond q = Eigen::Map<const Eigen::Quaterniond>(from + 3).slerp(
        t, Eigen::Map<const Eigen::Quaterniond>(to + 3));
    for (int k = 0; k < 3; ++k) state[k] = from[k] + t * (to[k] - from[k]);
    for (int k = 0; k < 4; ++k) state[3 + k] = q.coeffs()[k];
  }
  void computeTransform(const double* joint_values, Eigen::Isometry3d& transf) const override {
    transf = Eigen::Translation3d(joint_values[0], joint_values[1], joint_values[2]) *
             Eigen::Map<const Eigen::Quaterniond>(joint_values + 3);
  }
};

}  // namespace moveit::core
