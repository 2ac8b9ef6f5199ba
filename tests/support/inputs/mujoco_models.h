// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "dyop/io/robot_file.h"
#include "support/inputs/random_inputs.h"

namespace dyop::testing {

/// MuJoCo's rays pass what is fully transparent, so that is what visual geoms are. A random model: a tree of bodies with every kind of joint, of geom and of orientation.
class RandomModel {
 public:
  explicit RandomModel(std::uint64_t seed) : random_(seed) {}

  std::string text() {
    uses_degrees_ = one_of(2) == 0;
    std::ostringstream xml;
    xml << "<mujoco model='random'>\n<compiler angle='" << (uses_degrees_ ? "degree" : "radian")
        << "' eulerseq='" << sequence() << "' inertiafromgeom='true'/>\n"
        << "<option><flag filterparent='" << (one_of(3) == 0 ? "disable" : "enable")
        << "'/></option>\n<size njmax='100' nconmax='2000' nstack='500000'/>\n"
        << (one_of(2) == 0 ? "<default class='top'>" : "<default>")
        << "<geom margin='100' density='100'/><joint axis='1 0 0'/>\n"
        << "<default class='thin'><geom type='capsule' size='.1 .3'/>"
        << "<joint type='slide'/></default>\n"
        << "<default class='seen'><geom contype='0' conaffinity='0' rgba='0 0 0 0'/></default>\n"
        << "</default>\n<asset>" << mesh("solid", true) << mesh("hull", false) << "</asset>\n"
        << "<worldbody><geom name='floor' type='plane' size='0 0 1' pos='0 0 -4'/>\n"
        << (one_of(2) == 0 ? geom() : "");
    bodies_ = 0;
    while (bodies_ < 6) xml << body(0);
    xml << "</worldbody>\n<contact>" << exclusion() << "</contact></mujoco>\n";
    return xml.str();
  }

 private:
  int one_of(int count) { return int(random_() % std::uint64_t(count)); }
  Scalar number(Scalar lower, Scalar upper) { return random_number(lower, upper, random_); }

  std::string vector(int count, Scalar lower, Scalar upper) {
    std::ostringstream text;
    text.precision(17);
    for (int k = 0; k < count; ++k) text << number(lower, upper) << ' ';
    return text.str();
  }
  Scalar angle() { return number(-3, 3) * (uses_degrees_ ? 57 : 1); }

  std::string sequence() {
    std::string letters;
    for (int k = 0; k < 3; ++k) letters += "xyzXYZ"[one_of(6)];
    return letters;
  }

  std::string orientation() {
    switch (one_of(6)) {
      case 0:
        return " quat='" + vector(4, -2, 2) + "'";
      case 1:
        return " axisangle='" + vector(3, -1, 1) + std::to_string(angle()) + "'";
      case 2:
        return " euler='" + std::to_string(angle()) + " " + std::to_string(angle()) + " " +
               std::to_string(angle()) + "'";
      case 3:
        return " xyaxes='" + vector(6, -1, 1) + "'";
      case 4:
        return " zaxis='" + vector(3, -1, 1) + "'";
      default:
        return "";
    }
  }
  std::string place() { return " pos='" + vector(3, -1, 1) + "'" + orientation(); }

  // An irregular tetrahedron, with or without its faces.
  std::string mesh(const std::string& name, bool has_faces) {
    std::string text = "<mesh name='" + name + "' vertex='0 0 0 .5 .1 0 .1 .6 0 0 .1 .7'";
    if (has_faces) text += " face='0 2 1 0 1 3 1 2 3 0 3 2'";
    if (one_of(2) == 0) text += " scale='" + std::string(one_of(2) ? "1 -2 .5'" : "2 1 1.5'");
    if (one_of(2) == 0) text += " refpos='" + vector(3, -1, 1) + "'";
    if (one_of(2) == 0) text += " refquat='" + vector(4, -1, 1) + "'";
    return text + "/>";
  }

  std::string geom() {
    std::string text = "<geom";
    if (one_of(4) == 0) text += " class='seen'";
    if (one_of(4) == 0) {
      text += " contype='" + std::to_string(1 << one_of(2)) + "' conaffinity='" +
              std::to_string(1 << one_of(2)) + "' rgba='1 1 1 1'";
    }
    const int kind = one_of(8);
    constexpr const char* kTypes[] = {"sphere", "capsule", "cylinder", "box", "ellipsoid"};
    if (kind < 5) {
      text += std::string(" type='") + kTypes[kind] + "'";
      const bool is_long = kind > 0 && one_of(2) == 0;
      text += " size='" + vector(3, .05, .5) + "'";
      text += is_long ? " fromto='" + vector(6, -1, 1) + "'" : place();
    } else if (kind < 7) {
      // By default MuJoCo 2.2 only approximates the volume of a mesh.
      text += " type='mesh' mass='2' mesh='" + std::string(kind == 5 ? "solid'" : "hull'");
      text += place();
    } else {
      text = "<geom class='thin'" + place();
    }
    return text + "/>\n";
  }

  // Only the last joint of a body may be a ball.
  std::string joint(bool is_last) {
    std::string text = "<joint name='j" + std::to_string(joints_++) + "'";
    const int kind = is_last ? one_of(5) : one_of(3);
    if (kind == 4) return text + " class='thin' ref='" + std::to_string(number(-1, 1)) + "'/>\n";
    if (kind == 3) return text + " type='ball' pos='" + vector(3, -1, 1) + "'/>\n";
    text += kind == 2 ? " type='slide'" : " type='hinge'";
    if (one_of(2) == 0) text += " pos='" + vector(3, -1, 1) + "'";
    if (one_of(2) == 0) text += " axis='" + vector(3, -1, 1) + "'";
    if (one_of(2) == 0)
      text += " ref='" + std::to_string(kind == 2 ? number(-1, 1) : angle()) + "'";
    return text + "/>\n";
  }

  std::string body(int depth) {
    const std::string name = "b" + std::to_string(bodies_++);
    std::string text = "<body name='" + name + "'" + place();
    if (one_of(5) == 0) text += " childclass='thin'";
    text += ">\n";
    const bool is_free = depth == 0 && one_of(4) == 0;
    if (is_free) {
      text += "<freejoint name='j" + std::to_string(joints_++) + "'/>\n";
    } else {
      for (int k = one_of(4); k > 0; --k) text += joint(k == 1);
    }
    // A body that moves needs a mass, so one geom that is no flat mesh.
    text += "<geom type='sphere' size='.2' pos='" + vector(3, -1, 1) + "'/>\n";
    for (int k = one_of(3); k > 0; --k) text += geom();
    while (bodies_ < 12 && depth < 4 && one_of(2) == 0) text += body(depth + 1);
    return text + "</body>\n";
  }

  std::string exclusion() {
    if (one_of(2) == 0) return "";
    return "<exclude body1='b0' body2='b" + std::to_string(1 + one_of(bodies_ - 1)) + "'/>";
  }

  std::mt19937_64 random_;
  bool uses_degrees_ = true;
  int joints_ = 0;
  int bodies_ = 0;
};

struct MujocoDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

/// One model in both programs, in the same state.
class Both {
 public:
  explicit Both(const std::filesystem::path& file) : robot(load_robot(file)) {
    char error[1000] = "";
    model.reset(mj_loadXML(file.c_str(), nullptr, error, sizeof error));
    EXPECT_NE(model, nullptr) << error;
    if (model) data.reset(mj_makeData(model.get()));
  }

  int body(const std::string& link) const {
    return mj_name2id(model.get(), mjOBJ_BODY, link.c_str());
  }
  // A plane is a link of its own here, a geom of the world there.
  int body_of_link(std::size_t link) const {
    return std::max(body(robot.chain->links()[link].name), 0);
  }

  void move(std::mt19937_64& random) {
    JointVector q(Eigen::Index(robot.free_count()));
    for (Eigen::Index k = 0; k < q.size(); ++k) q[k] = random_number(-2, 2, random);
    for (int joint = 0; joint < model->njnt; ++joint) set(joint, q);
    mj_kinematics(model.get(), data.get());
    mj_collision(model.get(), data.get());
    poses = robot.chain->link_poses(robot.expand(q));
  }

  Robot robot;
  std::unique_ptr<mjModel, MujocoDeleter> model;
  std::unique_ptr<mjData, MujocoDeleter> data;
  std::vector<RigidPose> poses;

 private:
  Scalar coordinate(const std::string& joint, const JointVector& q) const {
    return q[robot.free_index(joint).value()];
  }

  void set(int joint, const JointVector& q) {
    const std::string name = mj_id2name(model.get(), mjOBJ_JOINT, joint);
    mjtNum* address = data->qpos + model->jnt_qposadr[joint];
    const int type = model->jnt_type[joint];
    if (type == mjJNT_HINGE || type == mjJNT_SLIDE) {
      *address = coordinate(name, q);
      return;
    }
    const auto turn = [&](const char* part, const Vector3& axis) {
      return rotation_from_vector(coordinate(name + part, q) * axis);
    };
    const Matrix3 R = turn("/yaw", Vector3::UnitZ()) * turn("/pitch", Vector3::UnitY()) *
                      turn("/roll", Vector3::UnitX());
    RigidPose X(R, Vector3::Zero());
    if (type == mjJNT_FREE) {
      const Vector3 p(coordinate(name + "/x", q), coordinate(name + "/y", q),
                      coordinate(name + "/z", q));
      const mjtNum* start = model->qpos0 + model->jnt_qposadr[joint];
      const Quaternion turned(start[3], start[4], start[5], start[6]);
      X = RigidPose(turned, Vector3(start[0], start[1], start[2])) * RigidPose(R, p);
      for (int k = 0; k < 3; ++k) *address++ = X.translation()[k];
    }
    const Quaternion turned = X.quaternion();
    for (const Scalar number : {turned.w(), turned.x(), turned.y(), turned.z()})
      *address++ = number;
  }
};

}  // namespace dyop::testing
