// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <iterator>
#include <limits>
#include <memory>
#include <moveit/collision_detection/collision_detector_allocator.hpp>
#include <moveit/collision_detection/collision_env.hpp>
#include <optional>
#include <rclcpp/logger.hpp>
#include <rclcpp/logging.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dyop/adapters/moveit_chain.h"
#include "dyop/adapters/moveit_shapes.h"
#include "dyop/distance/distance.h"
#include "dyop/toi/least_distance.h"
#include "dyop/toi/time_of_impact.h"

namespace dyop::adapters_internal {

using MoveitLinks = std::set<const moveit::core::LinkModel*>;

/// One shape of a link, of a body that a link carries, or of an object of the world.
struct MoveitPart {
  std::string body = {};
  collision_detection::BodyType type = collision_detection::BodyType::WORLD_OBJECT;
  const moveit::core::LinkModel* link = nullptr;  ///< that moves it; null in the world
  const moveit::core::AttachedBody* attached = nullptr;
  std::shared_ptr<const Shape> shape = {};  ///< null if it has a fault
  RigidPose X_LS = {};                      ///< in the frame of the link
  RigidPose X_WS = {};
  Scalar padding = 0;
  std::string fault = {};  ///< why it has no shape or pose

  bool is_same_body(const MoveitPart& other) const {
    return type == other.type && body == other.body;
  }
};

struct MoveitPair {
  const MoveitPart* a = nullptr;
  const MoveitPart* b = nullptr;

  Scalar padding() const { return a->padding + b->padding; }
  std::string names() const { return "\"" + a->body + "\" and \"" + b->body + "\""; }
};

/// What MoveIt allows a pair to do.
struct MoveitRule {
  bool is_skipped = false;
  collision_detection::DecideContactFn decide;  ///< if contacts may be allowed one by one
};

inline bool is_active(const MoveitPart& part, const MoveitLinks* active) {
  return active == nullptr || (part.link != nullptr && active->contains(part.link));
}

// Links may touch what is attached to them if it says so.
inline bool may_touch(const MoveitPart& link, const MoveitPart& attached) {
  return link.attached == nullptr && attached.attached != nullptr &&
         link.type == collision_detection::BodyType::ROBOT_LINK &&
         attached.attached->getTouchLinks().contains(link.body);
}

inline MoveitRule rule_of(const MoveitPair& pair,
                          const collision_detection::AllowedCollisionMatrix* acm,
                          const MoveitLinks* active) {
  const MoveitPart& a = *pair.a;
  const MoveitPart& b = *pair.b;
  const bool is_carried_together =
      a.attached != nullptr && b.attached != nullptr && a.link == b.link;
  if (a.is_same_body(b) || is_carried_together || may_touch(a, b) || may_touch(b, a) ||
      (!is_active(a, active) && !is_active(b, active))) {
    return {.is_skipped = true, .decide = {}};
  }
  collision_detection::AllowedCollision::Type type = collision_detection::AllowedCollision::NEVER;
  if (acm == nullptr || !acm->getAllowedCollision(a.body, b.body, type)) return {};
  MoveitRule rule;
  rule.is_skipped = type == collision_detection::AllowedCollision::ALWAYS;
  if (type == collision_detection::AllowedCollision::CONDITIONAL)
    acm->getAllowedCollision(a.body, b.body, rule.decide);
  return rule;
}

/// A contact in MoveIt's form, the body whose name comes first as the first one.
inline collision_detection::Contact moveit_contact(const MoveitPair& pair,
                                                   const WitnessPair& witness, Scalar depth,
                                                   Scalar t) {
  const bool in_order = pair.a->body <= pair.b->body;
  const MoveitPart& first = in_order ? *pair.a : *pair.b;
  const MoveitPart& second = in_order ? *pair.b : *pair.a;
  const Vector3 p_WCa = witness.p_WCa + pair.a->padding * witness.nhat_AB_W;
  const Vector3 p_WCb = witness.p_WCb - pair.b->padding * witness.nhat_AB_W;
  collision_detection::Contact contact;
  contact.pos = (p_WCa + p_WCb) / 2;
  contact.normal = in_order ? witness.nhat_AB_W : Vector3(-witness.nhat_AB_W);
  contact.depth = depth;
  contact.body_name_1 = first.body;
  contact.body_type_1 = first.type;
  contact.body_name_2 = second.body;
  contact.body_type_2 = second.type;
  contact.percent_interpolation = t;
  contact.nearest_points[0] = in_order ? p_WCa : p_WCb;
  contact.nearest_points[1] = in_order ? p_WCb : p_WCa;
  return contact;
}

inline WitnessPair transformed(const RigidPose& X_WF, WitnessPair witness) {
  witness.p_WCa = X_WF * witness.p_WCa;
  witness.p_WCb = X_WF * witness.p_WCb;
  witness.nhat_AB_W = X_WF.rotation() * witness.nhat_AB_W;
  return witness;
}

/// Fills a result within the limits of the request.
class MoveitReport {
 public:
  MoveitReport(const collision_detection::CollisionRequest& request,
               collision_detection::CollisionResult& result)
      : request_(request), result_(result) {}

  bool is_done() const { return is_done_; }

  void add(const MoveitPair& pair, const std::vector<collision_detection::Contact>& contacts) {
    result_.collision = true;
    if (request_.contacts) {
      for (const collision_detection::Contact& contact : contacts) add_contact(contact);
    }
    if (request_.cost) add_cost(pair);
    const bool has_all = !request_.contacts || result_.contact_count >= request_.max_contacts;
    is_done_ = (has_all && !request_.cost) || (request_.is_done && request_.is_done(result_));
  }

 private:
  void add_contact(const collision_detection::Contact& contact) {
    if (result_.contact_count >= request_.max_contacts) return;
    auto& known = result_.contacts[{contact.body_name_1, contact.body_name_2}];
    if (known.size() >= request_.max_contacts_per_pair) return;
    known.push_back(contact);
    ++result_.contact_count;
  }

  // The box in which the boxes around both shapes overlap, padded, at the start.
  void add_cost(const MoveitPair& pair) {
    if (!pair.a->shape || !pair.b->shape) return;
    const AlignedBox box = world_box(*pair.a).intersection(world_box(*pair.b));
    if (box.isEmpty()) return;
    collision_detection::CostSource source;
    for (std::size_t k = 0; k < 3; ++k) {
      source.aabb_min[k] = box.min()[Eigen::Index(k)];
      source.aabb_max[k] = box.max()[Eigen::Index(k)];
    }
    source.cost = 1;
    result_.cost_sources.insert(source);
    while (result_.cost_sources.size() > request_.max_cost_sources)
      result_.cost_sources.erase(std::prev(result_.cost_sources.end()));
  }

  static AlignedBox world_box(const MoveitPart& part) {
    const AlignedBox box = part.shape->bounding_box();
    AlignedBox result;
    for (int k = 0; k < 8; ++k)  // corners
      result.extend(part.X_WS * box.corner(AlignedBox::CornerType(k)));
    const Vector3 around = Vector3::Constant(part.padding);
    return AlignedBox(result.min() - around, result.max() + around);
  }

  const collision_detection::CollisionRequest& request_;
  collision_detection::CollisionResult& result_;
  bool is_done_ = false;
};

}  // namespace dyop::adapters_internal

namespace dyop::adapters {

/// Collision checks for MoveIt 2 by proof. Written for MoveIt 2.12; compiled against stubs of its
/// interface, not against MoveIt itself.
///
/// What is reported free is proven so, rounding included: at one state, or on the whole way between
/// two states, all joints moving as RobotState::interpolate() moves them. What could not be decided
/// (a shape or joint of an unknown kind, a number that is not finite, a state that is not up to
/// date, a search that ran out of budget) is logged with its name and counts as a collision.
///
/// Between two states: links and what they carry (from the first state) against the world, and,
/// under an AllowedCollisionMatrix, against each other; without one, neighbours would always
/// touch. The earliest contacts come first, at `percent_interpolation`, up to which that pair is
/// free. Contacts that the matrix allows only on condition are not allowed here.
///
/// Padding is exact: a link is padded by all points within the padding. So mesh links are never
/// padded less than by MoveIt, and corners of boxes are rounded, where MoveIt's are not. Closed
/// meshes are solids. Depths of overlapping convex shapes come from libccd, without proof; those of
/// meshes are the padding. Const functions are thread-safe.
class MoveitCollisionEnv final : public collision_detection::CollisionEnv {
 public:
  using AllowedCollisionMatrix = collision_detection::AllowedCollisionMatrix;
  using CollisionRequest = collision_detection::CollisionRequest;
  using CollisionResult = collision_detection::CollisionResult;
  using DistanceRequest = collision_detection::DistanceRequest;
  using MoveitDistances = collision_detection::DistanceResult;
  using RobotState = moveit::core::RobotState;

  /// @throws InvalidArgument as MoveitChain; so does the constructor below.
  explicit MoveitCollisionEnv(const moveit::core::RobotModelConstPtr& model, double padding = 0,
                              double scale = 1)
      : CollisionEnv(model, padding, scale), chain_(std::make_shared<MoveitChain>(*model)) {}
  MoveitCollisionEnv(const moveit::core::RobotModelConstPtr& model,
                     const collision_detection::WorldPtr& world, double padding = 0,
                     double scale = 1)
      : CollisionEnv(model, world, padding, scale), chain_(std::make_shared<MoveitChain>(*model)) {}
  MoveitCollisionEnv(const MoveitCollisionEnv& other, const collision_detection::WorldPtr& world)
      : CollisionEnv(other, world), chain_(other.chain_), shapes_(other.shapes_) {}

  void checkSelfCollision(const CollisionRequest& req, CollisionResult& res,
                          const RobotState& state) const override {
    check_state(req, res, state, Against::Self, nullptr);
  }
  void checkSelfCollision(const CollisionRequest& req, CollisionResult& res,
                          const RobotState& state,
                          const AllowedCollisionMatrix& acm) const override {
    check_state(req, res, state, Against::Self, &acm);
  }
  void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                           const RobotState& state) const override {
    check_state(req, res, state, Against::World, nullptr);
  }
  void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                           const RobotState& state,
                           const AllowedCollisionMatrix& acm) const override {
    check_state(req, res, state, Against::World, &acm);
  }
  void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                           const RobotState& state1, const RobotState& state2,
                           const AllowedCollisionMatrix& acm) const override {
    check_path(req, res, state1, state2, &acm);
  }
  void checkRobotCollision(const CollisionRequest& req, CollisionResult& res,
                           const RobotState& state1, const RobotState& state2) const override {
    check_path(req, res, state1, state2, nullptr);
  }

  using CollisionEnv::distanceRobot;
  using CollisionEnv::distanceSelf;
  /// Distances are never above the true ones, padding taken off. A pair in collision has one of
  /// at most 0; with `enable_signed_distance` overlapping convex shapes have minus their depth.
  void distanceSelf(const DistanceRequest& req, MoveitDistances& res,
                    const RobotState& state) const override {
    measure_state(req, res, state, Against::Self);
  }
  void distanceRobot(const DistanceRequest& req, MoveitDistances& res,
                     const RobotState& state) const override {
    measure_state(req, res, state, Against::World);
  }

 private:
  using Part = adapters_internal::MoveitPart;
  using Pair = adapters_internal::MoveitPair;
  using Links = adapters_internal::MoveitLinks;
  using Contacts = std::vector<collision_detection::Contact>;
  enum class Against { Self, World };

  static void log_error(const std::string& message) {
    RCLCPP_ERROR(rclcpp::get_logger("dyop"), "%s", message.c_str());
  }
  static void log_undecided(const Pair& pair, const std::string& why) {
    log_error(core_internal::compose_message("could not decide whether ", pair.names(),
                                             " collide, so they do: ", why));
  }

  static bool is_up_to_date(const RobotState& state) {
    if (!state.dirtyCollisionBodyTransforms()) return true;
    log_error("the robot state is not up to date, so it collides: call its update() first");
    return false;
  }

  // Nothing could be decided.
  static void fail(CollisionResult& res) {
    res.collision = true;
    res.distance = std::min<Scalar>(res.distance, 0);
  }

  // --- Parts ---

  Part make_part(const shapes::ShapeConstPtr& shape, Scalar scale, const Eigen::Isometry3d& X_LS,
                 const Eigen::Isometry3d& X_WS, Part part) const {
    try {
      part.shape = shapes_->get(shape, scale);
      part.X_LS = pose_of(X_LS);
      part.X_WS = pose_of(X_WS);
      DYOP_REQUIRE(part.padding >= 0 && part.padding < kInfinity, "its padding is ", part.padding);
    } catch (const std::exception& error) {
      part.shape = nullptr;
      part.fault = "\"" + part.body + "\" has a shape that cannot be used: " + error.what();
    }
    return part;
  }

  // An octree with nothing in it has neither a shape nor a fault.
  static void add_part(std::vector<Part>& parts, Part part) {
    if (part.shape || !part.fault.empty()) parts.push_back(std::move(part));
  }

  std::vector<Part> robot_parts(const RobotState& state) const {
    std::vector<Part> parts;
    for (const moveit::core::LinkModel* link :
         getRobotModel()->getLinkModelsWithCollisionGeometry()) {
      const std::string& name = link->getName();
      Part part{.body = name,
                .type = collision_detection::BodyType::ROBOT_LINK,
                .link = link,
                .padding = getLinkPadding(name)};
      for (std::size_t k = 0; k < link->getShapes().size(); ++k) {
        add_part(parts, make_part(link->getShapes()[k], getLinkScale(name),
                                  link->getCollisionOriginTransforms()[k],
                                  state.getCollisionBodyTransform(link, k), part));
      }
    }
    std::vector<const moveit::core::AttachedBody*> bodies;
    state.getAttachedBodies(bodies);
    for (const moveit::core::AttachedBody* body : bodies) {
      const std::string& carrier = body->getAttachedLinkName();
      Part part{.body = body->getName(),
                .type = collision_detection::BodyType::ROBOT_ATTACHED,
                .link = body->getAttachedLink(),
                .attached = body,
                .padding = getLinkPadding(carrier)};
      for (std::size_t k = 0; k < body->getShapes().size(); ++k) {
        add_part(parts, make_part(body->getShapes()[k], getLinkScale(carrier),
                                  body->getShapePosesInLinkFrame()[k],
                                  body->getGlobalCollisionBodyTransforms()[k], part));
      }
    }
    return parts;
  }

  std::vector<Part> world_parts() const {
    std::vector<Part> parts;
    for (const auto& [name, object] : *getWorld()) {
      for (std::size_t k = 0; k < object->shapes_.size(); ++k) {
        const Eigen::Isometry3d& X_WS = object->global_shape_poses_[k];
        add_part(parts, make_part(object->shapes_[k], 1, X_WS, X_WS, Part{.body = name}));
      }
    }
    return parts;
  }

  static std::vector<Pair> self_pairs(const std::vector<Part>& robot) {
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < robot.size(); ++i) {
      for (std::size_t j = i + 1; j < robot.size(); ++j) pairs.push_back({&robot[i], &robot[j]});
    }
    return pairs;
  }
  static std::vector<Pair> world_pairs(const std::vector<Part>& robot,
                                       const std::vector<Part>& world) {
    std::vector<Pair> pairs;
    for (const Part& a : robot) {
      for (const Part& b : world) pairs.push_back({&a, &b});
    }
    return pairs;
  }

  const Links* active_links(const std::string& group) const {
    return getRobotModel()->hasJointModelGroup(group)
               ? &getRobotModel()->getJointModelGroup(group)->getUpdatedLinkModelsSet()
               : nullptr;
  }

  // --- One state ---

  struct PlacedPair {
    Pair pair;
    RigidPose X_FA;  // in the frame F of the query
    RigidPose X_FB;
    RigidPose X_WF;
    Scalar t = 0;
  };

  static DistanceOptions solid_options(const Pair& pair) {
    DistanceOptions options;
    options.solid_a = is_closed_mesh(*pair.a->shape);
    options.solid_b = is_closed_mesh(*pair.b->shape);
    return options;
  }

  // Contacts at fixed poses, the nearest first; none if the pair is proven farther apart than
  // `reach`.
  static Contacts contacts_at(const PlacedPair& placed, Scalar reach, bool with_all) {
    const Pair& pair = placed.pair;
    DistanceOptions options = solid_options(pair);
    options.max_distance = reach;
    options.with_penetration = true;
    const DistanceResult nearest =
        dyop::distance(*pair.a->shape, placed.X_FA, *pair.b->shape, placed.X_FB, options);
    if (nearest.lower > reach) return {};
    WitnessPair witness = nearest;
    Scalar depth = pair.padding() - nearest.lower;
    if (nearest.penetration) {
      witness.nhat_AB_W = nearest.penetration->nhat_AB_W;
      const Vector3 half = nearest.penetration->nhat_AB_W * (nearest.penetration->depth / 2);
      witness.p_WCa = nearest.penetration->p_W + half;
      witness.p_WCb = nearest.penetration->p_W - half;
      depth += nearest.penetration->depth;
    }
    Contacts contacts{moveit_contact(pair, adapters_internal::transformed(placed.X_WF, witness),
                                     depth, placed.t)};
    if (!with_all) return contacts;
    for (const WitnessPair& other :
         find_contacts(*pair.a->shape, placed.X_FA, *pair.b->shape, placed.X_FB, pair.padding())) {
      const bool is_nearest = (other.p_WCa - nearest.p_WCa).norm() <= nearest.upper &&
                              (other.p_WCb - nearest.p_WCb).norm() <= nearest.upper;
      if (is_nearest) continue;
      contacts.push_back(moveit_contact(pair, adapters_internal::transformed(placed.X_WF, other),
                                        pair.padding() - other.lower, placed.t));
    }
    return contacts;
  }

  // What is not decided has one contact without a place.
  static Contacts undecided(const Pair& pair, Scalar t, const std::string& why) {
    log_undecided(pair, why);
    WitnessPair nowhere;
    nowhere.p_WCa = pair.a->X_WS.translation();
    nowhere.p_WCb = pair.b->X_WS.translation();
    return {moveit_contact(pair, nowhere, 0, t)};
  }
  static std::string fault_of(const Pair& pair) {
    return pair.a->fault.empty() ? pair.b->fault : pair.a->fault;
  }

  // Contacts at one state, without those that the rule allows: of what is not decided it is not
  // asked.
  static Contacts examine(const Pair& pair, bool with_all,
                          const adapters_internal::MoveitRule& rule) {
    const std::string fault = fault_of(pair);
    if (!fault.empty()) return undecided(pair, 0, fault);
    try {
      const PlacedPair placed{.pair = pair, .X_FA = pair.a->X_WS, .X_FB = pair.b->X_WS, .X_WF = {}};
      Contacts contacts = contacts_at(placed, pair.padding(), with_all || bool(rule.decide));
      if (rule.decide) std::erase_if(contacts, [&rule](auto& found) { return rule.decide(found); });
      return contacts;
    } catch (const std::exception& error) {
      return undecided(pair, 0, error.what());
    }
  }

  void check_state(const CollisionRequest& req, CollisionResult& res, const RobotState& state,
                   Against against, const AllowedCollisionMatrix* acm) const {
    if (!is_up_to_date(state)) return fail(res);
    const std::vector<Part> robot = robot_parts(state);
    const std::vector<Part> world = against == Against::World ? world_parts() : std::vector<Part>();
    const std::vector<Pair> pairs =
        against == Against::World ? world_pairs(robot, world) : self_pairs(robot);
    adapters_internal::MoveitReport report(req, res);
    const Links* active = active_links(req.group_name);
    for (const Pair& pair : pairs) {
      const adapters_internal::MoveitRule rule = rule_of(pair, acm, active);
      if (rule.is_skipped) continue;
      const Contacts contacts = examine(pair, req.contacts && req.max_contacts_per_pair > 1, rule);
      if (contacts.empty()) continue;
      report.add(pair, contacts);
      if (report.is_done()) break;
    }
    if (req.distance) report_distance(req, res, pairs, acm);
  }

  void report_distance(const CollisionRequest& req, CollisionResult& res,
                       const std::vector<Pair>& pairs, const AllowedCollisionMatrix* acm) const {
    DistanceRequest request;
    request.group_name = req.group_name;
    request.acm = acm;
    request.active_components_only = active_links(req.group_name);
    request.enable_nearest_points = req.detailed_distance;
    MoveitDistances found;
    measure(request, found, pairs);
    res.distance = std::min(res.distance, found.minimum_distance.distance);
    if (req.detailed_distance) res.distance_result = found;
  }

  // --- Between two states ---

  struct Hit {
    Pair pair;
    Contacts contacts;
    Scalar t = 0;
  };

  struct PairMotion {
    std::shared_ptr<const Motion> X_FA;
    std::shared_ptr<const Motion> X_FB;
    std::shared_ptr<const Motion> X_WF;
  };
  // Two links are examined in the frame of the link where their branches meet: motion that they
  // share costs nothing.
  static PairMotion motions_of(const Pair& pair, const MoveitPath& path) {
    const KinematicChain& chain = path.chain();
    const auto at = [](const RigidPose& X) { return std::make_shared<RestMotion>(X); };
    const std::size_t a = chain.find_link(pair.a->link->getName()).value();
    if (pair.b->link == nullptr) {
      return {std::make_shared<ComposedMotion>(path.link_motion(a), at(pair.a->X_LS)),
              at(pair.b->X_WS), at(RigidPose())};
    }
    const std::size_t b = chain.find_link(pair.b->link->getName()).value();
    const std::size_t base = chain.common_ancestor(a, b);
    return {std::make_shared<ComposedMotion>(path.link_motion(a, base), at(pair.a->X_LS)),
            std::make_shared<ComposedMotion>(path.link_motion(b, base), at(pair.b->X_LS)),
            path.link_motion(base)};
  }

  static std::optional<Hit> first_hit(const Pair& pair, const MoveitPath& path, bool with_all) {
    const std::string fault = fault_of(pair);
    if (!fault.empty()) return Hit{pair, undecided(pair, 0, fault), 0};
    try {
      const PairMotion motions = motions_of(pair, path);
      ToiOptions options;
      options.target_distance = pair.padding();
      options.with_contacts = with_all;
      options.solid_a = is_closed_mesh(*pair.a->shape);
      options.solid_b = is_closed_mesh(*pair.b->shape);
      const ToiResult found = time_of_impact(*pair.a->shape, *motions.X_FA, *pair.b->shape,
                                             *motions.X_FB, kUnit, options);
      if (found.status == ToiStatus::Separated) return std::nullopt;
      const RigidPose X_WF = motions.X_WF->pose(found.t_safe);
      if (found.status == ToiStatus::Impact && with_all) {
        Hit hit{pair, {}, found.t_safe};
        for (const WitnessPair& contact : found.contacts)
          hit.contacts.push_back(
              moveit_contact(pair, adapters_internal::transformed(X_WF, contact), 0, found.t_safe));
        return hit;
      }
      const bool is_decided =
          found.status == ToiStatus::Impact || found.status == ToiStatus::InitiallyWithinTarget;
      if (!is_decided) log_undecided(pair, std::string(name_of(found.status)));
      return Hit{pair,
                 contacts_at({pair, found.X_WA, found.X_WB, X_WF, found.t_safe}, kInfinity, false),
                 found.t_safe};
    } catch (const std::exception& error) {
      return Hit{pair, undecided(pair, 0, error.what()), 0};
    }
  }

  void check_path(const CollisionRequest& req, CollisionResult& res, const RobotState& state1,
                  const RobotState& state2, const AllowedCollisionMatrix* acm) const {
    if (!is_up_to_date(state1) || !is_up_to_date(state2)) return fail(res);
    try {
      const MoveitPath path = chain_->path(state1, state2);
      const std::vector<Part> robot = robot_parts(state1);
      const std::vector<Part> world = world_parts();
      std::vector<Pair> pairs = world_pairs(robot, world);
      if (acm != nullptr) {
        const std::vector<Pair> self = self_pairs(robot);
        pairs.insert(pairs.end(), self.begin(), self.end());
      }
      const Links* active = active_links(req.group_name);
      std::erase_if(
          pairs, [acm, active](const Pair& pair) { return rule_of(pair, acm, active).is_skipped; });
      report_hits(req, res, pairs, path);
      if (req.distance) res.distance = std::min(res.distance, least_clearance(pairs, path));
    } catch (const std::exception& error) {
      log_error(core_internal::compose_message(
          "could not decide whether the way between two states is free, so it is not: ",
          error.what()));
      fail(res);
    }
  }

  static void report_hits(const CollisionRequest& req, CollisionResult& res,
                          const std::vector<Pair>& pairs, const MoveitPath& path) {
    const bool with_all = req.contacts && req.max_contacts_per_pair > 1;
    const bool wants_one = !req.contacts && !req.cost && !req.is_done;
    std::vector<Hit> hits;
    for (const Pair& pair : pairs) {
      if (std::optional<Hit> hit = first_hit(pair, path, with_all)) hits.push_back(std::move(*hit));
      if (wants_one && !hits.empty()) break;
    }
    std::stable_sort(hits.begin(), hits.end(),
                     [](const Hit& a, const Hit& b) { return a.t < b.t; });
    adapters_internal::MoveitReport report(req, res);
    for (const Hit& hit : hits) {
      report.add(hit.pair, hit.contacts);
      if (report.is_done()) return;
    }
  }

  // A lower bound of the least distance on the whole way, padding taken off.
  static Scalar least_clearance(const std::vector<Pair>& pairs, const MoveitPath& path) {
    Scalar least = std::numeric_limits<Scalar>::max();
    for (const Pair& pair : pairs) {
      if (!fault_of(pair).empty()) return std::min<Scalar>(least, 0);
      const PairMotion motions = motions_of(pair, path);
      LeastDistanceOptions options;
      options.max_distance = std::max<Scalar>(least + pair.padding(), 0);
      options.solid_a = is_closed_mesh(*pair.a->shape);
      options.solid_b = is_closed_mesh(*pair.b->shape);
      const LeastDistanceResult found = dyop::least_distance(
          *pair.a->shape, *motions.X_FA, *pair.b->shape, *motions.X_FB, kUnit, options);
      if (found.status == LeastDistanceStatus::FartherThanMaxDistance) continue;
      least = std::min(least, found.lower - pair.padding());
    }
    return least;
  }

  // --- Distances ---

  void measure_state(const DistanceRequest& req, MoveitDistances& res, const RobotState& state,
                     Against against) const {
    if (!is_up_to_date(state)) {
      res.collision = true;
      res.minimum_distance.distance = 0;
      return;
    }
    const std::vector<Part> robot = robot_parts(state);
    const std::vector<Part> world = against == Against::World ? world_parts() : std::vector<Part>();
    measure(req, res, against == Against::World ? world_pairs(robot, world) : self_pairs(robot));
  }

  static void measure(const DistanceRequest& req, MoveitDistances& res,
                      const std::vector<Pair>& pairs) {
    using collision_detection::DistanceRequestTypes::GLOBAL;
    for (const Pair& pair : pairs) {
      if (rule_of(pair, req.acm, req.active_components_only).is_skipped) continue;
      const bool is_first_named_first = pair.a->body <= pair.b->body;
      const std::pair<std::string, std::string> key = is_first_named_first
                                                          ? std::pair(pair.a->body, pair.b->body)
                                                          : std::pair(pair.b->body, pair.a->body);
      const std::optional<collision_detection::DistanceResultsData> data =
          measured(req, pair, threshold_of(req, res, key));
      if (!data) continue;
      if (data->distance <= 0) res.collision = true;
      if (data->distance < res.minimum_distance.distance) res.minimum_distance = *data;
      if (req.type == GLOBAL) {
        if (res.collision && !req.enable_signed_distance) return;
      } else {
        store(req, res.distances[key], *data);
      }
    }
  }

  using PairKey = std::pair<std::string, std::string>;

  static Scalar threshold_of(const DistanceRequest& req, const MoveitDistances& res,
                             const PairKey& key) {
    using namespace collision_detection::DistanceRequestTypes;
    if (req.type == GLOBAL) return std::min(req.distance_threshold, res.minimum_distance.distance);
    const auto known = res.distances.find(key);
    const bool has_one = known != res.distances.end() && !known->second.empty();
    if (req.type == SINGLE && has_one)
      return std::min(req.distance_threshold, known->second.front().distance);
    return req.distance_threshold;
  }

  static void store(const DistanceRequest& req,
                    std::vector<collision_detection::DistanceResultsData>& known,
                    const collision_detection::DistanceResultsData& data) {
    using namespace collision_detection::DistanceRequestTypes;
    if (req.type == SINGLE) known.clear();  // the new one is nearer
    if (req.type == LIMITED && known.size() >= req.max_contacts_per_body) return;
    known.push_back(data);
  }

  // Nothing if the pair is farther apart than the threshold.
  static std::optional<collision_detection::DistanceResultsData> measured(
      const DistanceRequest& req, const Pair& pair, Scalar threshold) {
    collision_detection::DistanceResultsData data;
    data.link_names[0] = pair.a->body;
    data.link_names[1] = pair.b->body;
    data.body_types[0] = pair.a->type;
    data.body_types[1] = pair.b->type;
    data.distance = 0;
    const std::string fault = fault_of(pair);
    if (!fault.empty()) {
      log_undecided(pair, fault);
      return data;
    }
    try {
      DistanceOptions options = solid_options(pair);
      options.max_distance = std::max<Scalar>(threshold + pair.padding(), 0);
      options.with_penetration = req.enable_signed_distance;
      const DistanceResult found =
          dyop::distance(*pair.a->shape, pair.a->X_WS, *pair.b->shape, pair.b->X_WS, options);
      data.distance = found.lower - pair.padding();
      data.normal = found.nhat_AB_W;
      if (found.penetration) {
        data.distance -= found.penetration->depth;
        data.normal = found.penetration->nhat_AB_W;
      }
      if (found.status == DistanceStatus::FartherThanMaxDistance || data.distance >= threshold)
        return std::nullopt;
      data.nearest_points[0] = found.p_WCa + pair.a->padding * found.nhat_AB_W;
      data.nearest_points[1] = found.p_WCb - pair.b->padding * found.nhat_AB_W;
    } catch (const std::exception& error) {
      log_undecided(pair, error.what());
    }
    return data;
  }

  static constexpr TimeInterval kUnit{0, 1};

  std::shared_ptr<const MoveitChain> chain_;
  std::shared_ptr<MoveitShapeCache> shapes_ = std::make_shared<MoveitShapeCache>();
};

/// Its create() is what PlanningScene::allocateCollisionDetector() takes.
class MoveitCollisionDetectorAllocator final
    : public collision_detection::CollisionDetectorAllocatorTemplate<
          MoveitCollisionEnv, MoveitCollisionDetectorAllocator> {
 public:
  inline static const std::string NAME = "dyop";
};

}  // namespace dyop::adapters
