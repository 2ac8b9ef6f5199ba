// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of MoveIt 2.12 with just what the adapter and its tests use.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <moveit/collision_detection/collision_common.hpp>
#include <string>
#include <utility>

namespace collision_detection {

namespace AllowedCollision {
enum Type { NEVER, ALWAYS, CONDITIONAL };
}

using DecideContactFn = std::function<bool(collision_detection::Contact&)>;

class AllowedCollisionMatrix {
 public:
  void setEntry(const std::string& name1, const std::string& name2, bool allowed) {
    types_[std::minmax(name1, name2)] =
        allowed ? AllowedCollision::ALWAYS : AllowedCollision::NEVER;
  }
  void setEntry(const std::string& name1, const std::string& name2, DecideContactFn& fn) {
    types_[std::minmax(name1, name2)] = AllowedCollision::CONDITIONAL;
    deciders_[std::minmax(name1, name2)] = fn;
  }
  bool getAllowedCollision(const std::string& name1, const std::string& name2,
                           DecideContactFn& fn) const {
    const auto found = deciders_.find(std::minmax(name1, name2));
    if (found != deciders_.end()) fn = found->second;
    return found != deciders_.end();
  }
  bool getAllowedCollision(const std::string& name1, const std::string& name2,
                           AllowedCollision::Type& allowed_collision) const {
    const auto found = types_.find(std::minmax(name1, name2));
    if (found != types_.end()) allowed_collision = found->second;
    return found != types_.end();
  }

 private:
  using Pair = std::pair<std::string, std::string>;
  std::map<Pair, AllowedCollision::Type> types_;
  std::map<Pair, DecideContactFn> deciders_;
};

}  // namespace collision_detection
