// SPDX-License-Identifier: BSD-3-Clause
// A stand-in for the interface of Tesseract 0.33 with just what the adapter and its tests use.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace tesseract_common {

enum class CollisionMarginPairOverrideType : std::uint8_t { NONE, REPLACE, MODIFY };

class CollisionMarginPairData {
 public:
  void setCollisionMargin(const std::string& obj1, const std::string& obj2, double margin) {
    margins_[std::minmax(obj1, obj2)] = margin;
  }
  std::optional<double> getCollisionMargin(const std::string& obj1, const std::string& obj2) const {
    const auto found = margins_.find(std::minmax(obj1, obj2));
    if (found == margins_.end()) return std::nullopt;
    return found->second;
  }
  void incrementMargins(double increment) {
    for (auto& entry : margins_) entry.second += increment;
  }
  void apply(const CollisionMarginPairData& pair_margin_data,
             CollisionMarginPairOverrideType override_type) {
    if (override_type == CollisionMarginPairOverrideType::NONE) return;
    if (override_type == CollisionMarginPairOverrideType::REPLACE) margins_.clear();
    for (const auto& [pair, margin] : pair_margin_data.margins_) margins_[pair] = margin;
  }

 private:
  std::map<std::pair<std::string, std::string>, double> margins_;
};

class CollisionMarginData {
 public:
  CollisionMarginData(double default_collision_margin = 0) : default_(default_collision_margin) {}
  void setDefaultCollisionMargin(double default_collision_margin) {
    default_ = default_collision_margin;
  }
  double getDefaultCollisionMargin() const { return default_; }
  void setCollisionMargin(const std::string& obj1, const std::string& obj2,
                          double collision_margin) {
    pairs_.setCollisionMargin(obj1, obj2, collision_margin);
  }
  double getCollisionMargin(const std::string& obj1, const std::string& obj2) const {
    return pairs_.getCollisionMargin(obj1, obj2).value_or(default_);
  }
  void incrementMargins(double increment) {
    default_ += increment;
    pairs_.incrementMargins(increment);
  }
  void apply(const CollisionMarginPairData& pair_margin_data,
             CollisionMarginPairOverrideType override_type) {
    pairs_.apply(pair_margin_data, override_type);
  }

 private:
  double default_;
  CollisionMarginPairData pairs_;
};

}  // namespace tesseract_common
