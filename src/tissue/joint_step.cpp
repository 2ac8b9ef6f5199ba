// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/tissue/soft_tissue.h"
#include "tissue/cone_solver.h"
#include "tissue/point_compliance.h"
#include "tissue/tissue_body.h"

namespace dyop {
namespace {

using tissue_internal::CarriedPoint;
using tissue_internal::ConeAnswer;
using tissue_internal::ConeSolver;
using tissue_internal::ConeState;
using tissue_internal::NodeVectors;
using tissue_internal::PointCompliance;
using tissue_internal::TissueBody;

// Added to every contact's own compliance, relative to it: contacts nearer than a cube are nearly
// the same one. So many solves, each about the forces of the one before, take its effect out again;
// with one, forces are some 4 % low.
constexpr Scalar kSoftening = 0.05;
constexpr int kNearer = 3;
// Contacts are added in passes, so many of those that cross by more than this part of the rest
// offset; a solve's time grows with the cube of all.
constexpr int kMostPasses = 6;
constexpr std::size_t kMostNew = 30;
constexpr std::size_t kMostActive = 120;
constexpr Scalar kCrossed = 0.1;
constexpr Scalar kBeside = 0.3;  // cubes
// Iterations of the first solve, whose forces are a guess.
constexpr int kFirstIterations = 2;

// The coordinates of a tool, zero for hinges that it does not have, and what they do along a contact's
// axes.
constexpr int kToolCoordinates = 6 + int(kMostHinges);
using ToolVector = Eigen::Matrix<Scalar, kToolCoordinates, 1>;
using ToolRows = Eigen::Matrix<Scalar, 3, kToolCoordinates>;

ToolVector padded(const Eigen::VectorXd& coordinates) {
  ToolVector all = ToolVector::Zero();
  all.head(coordinates.size()) = coordinates;
  return all;
}

// A contact as the step's equations see it. Columns of `axes`: normal, two tangents.
struct JointPoint {
  std::size_t tool;
  CarriedPoint on_tissue;
  Matrix3 axes;
  ToolRows moves;  // of the tool's coordinates, along the axes
  // Along the axes, if neither the step nor the contacts' forces moved the tissue: along the normal
  // the gap at the end less the one wanted, along the tangents the tool's displacement relative to
  // the tissue in this step.
  Vector3 free = Vector3::Zero();
  std::optional<std::size_t> place = {};  // among the active ones
};

Matrix3 axes_of(const Vector3& normal) {
  Matrix3 axes;
  axes.col(0) = normal.normalized();
  axes.col(1) = normal.unitOrthogonal();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

class JointRun {
 public:
  JointRun(TissueBody& body, std::span<const JointTool> tools,
           std::vector<ToolContactPoint>& contacts)
      : body_(body), tools_(tools), contacts_(contacts), on_tissue_(body) {
    for (const JointTool& tool : tools) {
      whole_.push_back(padded(tool_displacement(tool.hinges.size(), tool.tool, tool.device)));
      springs_.push_back(padded(coupling_compliance(tool.coupling, tool.hinges)));
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      if (contacts[k].surface) add(k);
    }
  }

  JointReport run(const NodeVectors& others) {
    const NodeVectors start = body_.begin_step() + others;
    NodeVectors v = body_.velocities();
    NodeVectors impulses = body_.last_impulses();  // as a guess
    if (numbers_.empty() && impulses.isZero(0)) {
      report_.iterations = body_.solve(start, v, body_.options().most_iterations);
    } else {
      report_.iterations = body_.solve(start + impulses, v, kFirstIterations);
      answer(start, v, impulses);
    }
    for (std::size_t k = 0; k < tools_.size(); ++k) {
      const Eigen::Index used = 6 + Eigen::Index(tools_[k].hinges.size());
      const ToolVector way = whole_[k] + springs_way(k);
      report_.tools.push_back(displaced(tools_[k].tool, way.head(used)));
    }
    body_.finish_step(std::move(v), impulses + others);
    return report_;
  }

 private:
  void add(std::size_t number) {
    const ToolContactPoint& contact = contacts_[number];
    const SurfacePoint& surface = *contact.surface;
    DYOP_REQUIRE(contact.tool < tools_.size(), "step_jointly: contact ", number, " is of tool ",
                 contact.tool, " of ", tools_.size());
    DYOP_REQUIRE(surface.triangle >= 0 && std::size_t(surface.triangle) < body_.triangles().size(),
                 "step_jointly: triangle ", surface.triangle, " of ", body_.triangles().size());
    const Vector3 weights(surface.weights[0], surface.weights[1], surface.weights[2]);
    DYOP_REQUIRE(weights.allFinite() && contact.p_W.allFinite() && contact.p_WO.allFinite() &&
                     contact.nhat_W.squaredNorm() > 0 && contact.nhat_W.squaredNorm() < kInfinity,
                 "step_jointly: contact ", number, " has numbers that are not finite");
    numbers_.push_back(number);
    const JointTool& tool = tools_[contact.tool];
    const Matrix3 axes = axes_of(contact.nhat_W);
    const Eigen::MatrixXd jacobian =
        tool_jacobian(tool.hinges, tool.tool, {contact.p_W, contact.hinge});
    ToolRows moves = ToolRows::Zero();
    moves.leftCols(jacobian.cols()) = axes.transpose() * jacobian;
    points_.push_back({contact.tool, body_.carried_point(surface.triangle, weights), axes, moves});
  }

  // The forces of a few contacts, then of those also that would be crossed, and so on: each time
  // from what the tissue really did under the forces before. Meanwhile that is known only where the
  // contacts are.
  void answer(const NodeVectors& start, NodeVectors& v, NodeVectors& impulses) {
    find_free_ways();
    const NodeVectors guess = std::exchange(impulses, NodeVectors::Zero(3, v.cols()));
    const std::vector<std::int32_t> nodes = carrying_nodes();
    NodeVectors seen = v;
    body_.add_response(-guess, nodes, seen);
    for (int pass = 0; pass < kMostPasses && add_crossed(seen); ++pass) {
      const NodeVectors change = find_forces(seen, impulses);
      body_.add_response(change, nodes, seen);
    }
    v += body_.precondition(impulses - guess);
    report_.iterations += body_.solve(start + impulses, v, body_.options().most_iterations);
    add_crossed(v);
    v += body_.precondition(find_forces(v, impulses));
    tell();
  }

  // All that carry a contact and can move.
  std::vector<std::int32_t> carrying_nodes() const {
    std::vector<std::int32_t> nodes;
    for (const JointPoint& point : points_) {
      std::copy_if(point.on_tissue.nodes.begin(), point.on_tissue.nodes.end(),
                   std::back_inserter(nodes),
                   [&](std::int32_t node) { return body_.is_free(node); });
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
  }

  // The contacts' forces with these velocities of the tissue, which have the answer to the present
  // forces in them. Returns how the impulses change.
  NodeVectors find_forces(const NodeVectors& v, NodeVectors& impulses) {
    extend_compliance();
    solve_contacts(v);
    NodeVectors wanted = impulses_of_contacts();
    NodeVectors change = wanted - impulses;
    impulses = std::move(wanted);
    return change;
  }

  // Those that the present forces leave too near, the worst first.
  bool add_crossed(const NodeVectors& v) {
    std::vector<ToolVector> springs;
    for (std::size_t k = 0; k < tools_.size(); ++k) springs.push_back(springs_way(k));
    std::vector<std::pair<Scalar, std::size_t>> crossed;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (points_[i].place) continue;
      const Scalar gap = apart(i, v)[0] + points_[i].moves.row(0).dot(springs[points_[i].tool]);
      if (gap < -kCrossed * tool_of(i).rest_offset || points_.size() <= kMostActive) {
        crossed.emplace_back(gap, i);
      }
    }
    std::sort(crossed.begin(), crossed.end());
    const std::size_t known = active_.size();
    for (const auto& [gap, i] : crossed) {
      const bool has_room = active_.size() < std::min(known + kMostNew, kMostActive);
      if (points_.size() <= kMostActive || (has_room && is_apart(i, known))) {
        points_[i].place = active_.size();
        active_.push_back(i);
      }
    }
    forces_.conservativeResize(3 * Eigen::Index(active_.size()));
    forces_.tail(3 * Eigen::Index(active_.size() - known)).setZero();
    return active_.size() > known;
  }

  // Whether the point is not beside one that this pass has added, whose force may lift it as well.
  bool is_apart(std::size_t point, std::size_t first) const {
    const Scalar near = kBeside * body_.options().cube_edge;
    return std::none_of(active_.begin() + std::ptrdiff_t(first), active_.end(), [&](std::size_t i) {
      return (contacts_[numbers_[i]].p_WO - contacts_[numbers_[point]].p_WO).norm() < near;
    });
  }

  const JointTool& tool_of(std::size_t point) const { return tools_[points_[point].tool]; }

  // What the contacts' forces do to a tool's springs: coordinates of the tool.
  ToolVector springs_way(std::size_t tool) const {
    ToolVector pull = ToolVector::Zero();
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const JointPoint& point = points_[active_[k]];
      if (point.tool != tool) continue;
      pull += point.moves.transpose() * forces_.segment<3>(3 * Eigen::Index(k));
    }
    return springs_[tool].cwiseProduct(pull);
  }

  // Of the springs, and of the tissue over a step, in the contacts' axes: for the contacts that were
  // added since.
  void extend_compliance() {
    const Eigen::Index known = tissue_compliance_.rows() / 3, count = Eigen::Index(active_.size());
    if (known == count) return;
    std::vector<const CarriedPoint*> added;
    for (Eigen::Index k = known; k < count; ++k) {
      added.push_back(&points_[active_[std::size_t(k)]].on_tissue);
    }
    on_tissue_.prepare(added);
    tissue_compliance_.conservativeResize(3 * count, 3 * count);
    compliance_.conservativeResize(3 * count, 3 * count);
    for (Eigen::Index k = known; k < count; ++k) add_compliance(k);
    softening_ = kSoftening / (1 + kSoftening) * compliance_.diagonal();
    report_.springs_share = springs_trace_ / (springs_trace_ + tissue_compliance_.trace());
  }

  // Of an active contact with those before it and with itself.
  void add_compliance(Eigen::Index k) {
    const JointPoint& one = points_[active_[std::size_t(k)]];
    const Scalar period = body_.options().period;
    const std::span<const Matrix3> answers = on_tissue_.add(one.on_tissue);
    const Eigen::Matrix<Scalar, kToolCoordinates, 3> pulled =
        springs_[one.tool].asDiagonal() * one.moves.transpose();
    for (Eigen::Index i = 0; i <= k; ++i) {
      const JointPoint& other = points_[active_[std::size_t(i)]];
      const Matrix3 tissue =
          period * period * (other.axes.transpose() * answers[std::size_t(i)] * one.axes);
      Matrix3 sum = tissue;
      if (other.tool == one.tool) sum += other.moves * pulled;
      tissue_compliance_.block<3, 3>(3 * i, 3 * k) = tissue;
      compliance_.block<3, 3>(3 * i, 3 * k) = sum;
      if (i == k) continue;
      tissue_compliance_.block<3, 3>(3 * k, 3 * i) = tissue.transpose();
      compliance_.block<3, 3>(3 * k, 3 * i) = sum.transpose();
    }
    springs_trace_ += (one.moves * pulled).trace();
    compliance_.diagonal().segment<3>(3 * k) *= 1 + kSoftening;
  }

  // Where the springs would take the tool's points without contacts, from the tissue as it is. What
  // slipped before the step has slipped; undoing it would swing from step to step.
  void find_free_ways() {
    std::vector<ToolVector> before;
    for (const JointTool& tool : tools_) {
      before.push_back(
          padded(tool_displacement(tool.hinges.size(), tool.tool, tool.start.value_or(tool.tool))));
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      JointPoint& point = points_[i];
      const ToolContactPoint& contact = contacts_[numbers_[i]];
      const Vector3 tissue = body_.place(point.on_tissue) - contact.p_WO;
      point.free = point.moves * whole_[point.tool] - point.axes.transpose() * tissue;
      point.free[0] += (contact.p_W - contact.p_WO).dot(point.axes.col(0)) - tool_of(i).rest_offset;
      const Vector3 already = point.moves * before[point.tool] - point.axes.transpose() * tissue;
      point.free.tail<2>() -= already.tail<2>();
    }
  }

  // JointPoint::free with these velocities of the tissue.
  Vector3 apart(std::size_t i, const NodeVectors& v) const {
    const JointPoint& point = points_[i];
    const Vector3 moved = body_.options().period * TissueBody::sum_of(point.on_tissue, v);
    return point.free - point.axes.transpose() * moved;
  }

  // v has the tissue's answer to the present forces in it, but not that of the springs.
  void solve_contacts(const NodeVectors& v) {
    if (active_.empty()) return;
    Eigen::VectorXd free(forces_.size());
    for (std::size_t k = 0; k < active_.size(); ++k) {
      free.segment<3>(3 * Eigen::Index(k)) = apart(active_[k], v);
    }
    free -= tissue_compliance_ * forces_;
    ConeSolver solver(compliance_, tools_[0].friction);
    for (int k = 0; k < kNearer; ++k) {
      const ConeAnswer answer = solver.solve(free - softening_.cwiseProduct(forces_), forces_);
      forces_ = answer.forces;
      states_ = answer.states;
      report_.rounds += answer.rounds;
      report_.is_exact = answer.is_exact;
    }
  }

  // On the nodes, of the contacts' forces over a step.
  NodeVectors impulses_of_contacts() const {
    NodeVectors sum = NodeVectors::Zero(3, body_.velocities().cols());
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const JointPoint& point = points_[active_[k]];
      const Vector3 force = point.axes * forces_.segment<3>(3 * Eigen::Index(k));
      TissueBody::add_impulse(point.on_tissue, -body_.options().period * force, sum);
    }
    return sum;
  }

  void tell() {
    for (const std::size_t number : numbers_) {
      contacts_[number].force_W.setZero();
      contacts_[number].state = ContactState::Open;
    }
    for (std::size_t k = 0; k < active_.size(); ++k) {
      ToolContactPoint& contact = contacts_[numbers_[active_[k]]];
      contact.force_W = points_[active_[k]].axes * forces_.segment<3>(3 * Eigen::Index(k));
      contact.state = states_[k] == ConeState::Open    ? ContactState::Open
                      : states_[k] == ConeState::Stick ? ContactState::Stick
                                                       : ContactState::Slip;
    }
  }

  TissueBody& body_;
  const std::span<const JointTool> tools_;
  std::vector<ToolContactPoint>& contacts_;
  std::vector<ToolVector> whole_;     // of each tool if it followed the device
  std::vector<ToolVector> springs_;   // the compliance of each tool's
  std::vector<std::size_t> numbers_;  // of the points' contacts
  std::vector<JointPoint> points_;
  std::vector<std::size_t> active_;  // points that may bear a force
  // Of these; with the softening in the diagonal of the whole.
  PointCompliance on_tissue_;
  Eigen::MatrixXd tissue_compliance_;
  Eigen::MatrixXd compliance_;
  Eigen::VectorXd softening_;
  Scalar springs_trace_ = 0;
  Eigen::VectorXd forces_;
  std::vector<ConeState> states_;
  JointReport report_;
};

}  // namespace

JointReport step_jointly(SoftTissue& tissue, const JointTool& tool,
                         std::vector<ToolContactPoint>& contacts,
                         std::span<const SurfaceForce> forces) {
  return step_jointly(tissue, std::span(&tool, 1), contacts, forces);
}

JointReport step_jointly(SoftTissue& tissue, std::span<const JointTool> tools,
                         std::vector<ToolContactPoint>& contacts,
                         std::span<const SurfaceForce> forces) {
  DYOP_REQUIRE(!tools.empty(), "step_jointly: there is no tool");
  for (const JointTool& tool : tools) tissue_internal::require_valid(tool);
  prepare_joint_steps(tissue);
  TissueBody& body = tissue_internal::body_of(tissue);
  return JointRun(body, tools, contacts).run(body.impulses_of(forces));
}

void prepare_joint_steps(SoftTissue& tissue) {
  tissue_internal::body_of(tissue).prepare_response();
}

namespace tissue_internal {

namespace {

void require_stiff(const char* name, Scalar stiffness) {
  DYOP_REQUIRE(stiffness > 0 && stiffness < kInfinity, "step_jointly: ", name,
               " of a tool's springs must be finite and > 0, not ", stiffness);
}

}  // namespace

void require_valid(const JointTool& tool) {
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    require_stiff("stiffness", tool.coupling.stiffness[axis]);
    require_stiff("rotational_stiffness", tool.coupling.rotational_stiffness[axis]);
  }
  for (const ToolHinge& hinge : tool.hinges)
    require_stiff("the hinges' stiffness", hinge.stiffness);
  DYOP_REQUIRE(tool.rest_offset >= 0 && tool.rest_offset < kInfinity,
               "step_jointly: rest_offset must be finite and >= 0, not ", tool.rest_offset);
  DYOP_REQUIRE(tool.friction >= 0 && tool.friction < kInfinity,
               "step_jointly: friction must be finite and >= 0, not ", tool.friction);
}

}  // namespace tissue_internal

}  // namespace dyop
