// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "dyop/chain/robot.h"
#include "dyop/io/robot_file.h"
#include "io/robot/xml_reader.h"

namespace dyop::io_internal {

/// A joint that follows another one: q = multiplier q(source) + offset.
struct Mimic {
  std::string source;
  Scalar multiplier = 1;
  Scalar offset = 0;
  XmlNode node;  ///< that says so
};

/// Several coordinates as a row of joints of one, with links without shapes between.
enum class SplitJoint {
  Planar,    ///< /x, /y across the joint's axis, /yaw about it
  Ball,      ///< /yaw, /pitch, /roll
  Floating,  ///< /x, /y, /z, /yaw, /pitch, /roll
};

/// A robot while its file is read: links, joints and what the file says of them.
class RobotParts {
 public:
  explicit RobotParts(const RobotFileOptions& options) : options_(options) {}

  /// @throws FileError if a link has this name already or there are too many.
  void add_link(const XmlNode& node, Link link, Scalar mass);
  /// Scales all masses so that they add up to this, unless all are 0.
  void set_total_mass(Scalar total);
  void add_joint(Joint joint) { joints_.push_back(std::move(joint)); }
  /// The joint's type and limits do not count.
  void add_split(const XmlNode& node, SplitJoint kind, const Joint& joint);
  /// False if the joint follows another one already; then nothing changes.
  bool add_mimic(const std::string& joint, Mimic mimic) {
    return mimics_.emplace(joint, std::move(mimic)).second;
  }
  void add_note(std::string note) { robot_.notes.push_back(std::move(note)); }
  void add_disabled(DisabledPair pair) { robot_.disabled_pairs.push_back(std::move(pair)); }
  /// Two neighbours that are checked nevertheless.
  void add_checked(const std::string& first, const std::string& second) {
    checked_.emplace_back(first, second);
  }
  bool has_link(const std::string& name) const { return link_names_.count(name) != 0; }
  /// This name, or the first like it that no link has.
  std::string free_name(std::string name) const;

  /// Reads the SRDF file of the options, if there is one, and makes the chain.
  /// @param name  The root's attribute that names the robot.
  /// @param notes Of the search for meshes.
  /// @throws FileError at `root` if links and joints are no tree.
  Robot finish(const XmlNode& root, const char* name, const std::vector<std::string>& notes);

 private:
  void couple();
  void reconcile_limits();
  void read_srdf();
  void require_own_srdf(const XmlNode& root) const;
  void read_group(const XmlNode& node);
  KinematicChain make_chain() const;

  const RobotFileOptions& options_;
  Robot robot_;
  std::vector<Link> links_;
  std::vector<Joint> joints_;
  std::set<std::string> link_names_;
  std::map<std::string, Mimic> mimics_;  // by joint
  std::vector<std::pair<std::string, std::string>> checked_;
};

/// @throws FileError at the first element or attribute that xacro has yet to expand: what it stands
/// for would be missing.
void require_expanded(const XmlFile& file);

/// The robot of a URDF file.
Robot read_urdf(const XmlFile& file, const RobotFileOptions& options);
/// The robot of a model in MuJoCo's format, MJCF.
Robot read_mjcf(const XmlFile& file, const RobotFileOptions& options);

}  // namespace dyop::io_internal
