// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "dyop/core/error.h"
#include "dyop/tissue/soft_tissue.h"
#include "tissue/cone_solver.h"
#include "tissue/tissue_body.h"

namespace dyop {
namespace {

using tissue_internal::CarriedPoint;
using tissue_internal::ConeAnswer;
using tissue_internal::ConeProblem;
using tissue_internal::ConeState;
using tissue_internal::NodeVectors;
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

// A contact as the step's equations see it. Columns of `axes`: normal, two tangents.
struct JointPoint {
  std::size_t tool;
  CarriedPoint on_tissue;
  Matrix3 axes;
  // Along the axes, since the contact was found:
  Vector3 free = Vector3::Zero();         // displacement of the tool if it followed the device
  Vector3 already = Vector3::Zero();      // that relative to the tissue before the step begins
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
      : body_(body), tools_(tools), contacts_(contacts) {
    for (const JointTool& tool : tools) {
      whole_.push_back(tool_displacement(tool.hinges.size(), tool.tool, tool.device));
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
      report_.tools.push_back(displaced(tools_[k].tool, whole_[k] + springs_way(k)));
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
    points_.push_back(
        {contact.tool, body_.carried_point(surface.triangle, weights), axes_of(contact.nhat_W)});
    tool_points_.push_back({contact.p_W, contact.hinge});
  }

  // The forces of a few contacts, then of those also that would be crossed, and so on: each time
  // from what the tissue really did under the forces before.
  void answer(const NodeVectors& start, NodeVectors& v, NodeVectors& impulses) {
    find_way_of_tool();
    // Without the guess.
    v -= body_.precondition(impulses);
    impulses.setZero();
    for (int pass = 0; pass < kMostPasses && add_crossed(v); ++pass) push(v, impulses);
    report_.iterations += body_.solve(start + impulses, v, body_.options().most_iterations);
    add_crossed(v);
    push(v, impulses);
    tell();
  }

  // Finds the forces anew, and what they change.
  void push(NodeVectors& v, NodeVectors& impulses) {
    build_compliance();
    solve_contacts(v);
    const NodeVectors wanted = impulses_of_contacts();
    v += body_.precondition(wanted - impulses);
    impulses = wanted;
  }

  // Those that the present forces leave too near, the worst first.
  bool add_crossed(const NodeVectors& v) {
    std::vector<Eigen::VectorXd> springs;
    for (std::size_t k = 0; k < tools_.size(); ++k) springs.push_back(springs_way(k));
    std::vector<std::pair<Scalar, std::size_t>> crossed;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (points_[i].place) continue;
      const Vector3 moved = points_[i].axes.transpose() * (jacobian(i) * springs[points_[i].tool]);
      const Scalar gap = apart(i, v)[0] + moved[0];
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
  Eigen::MatrixXd jacobian(std::size_t point) const {
    return tool_jacobian(tool_of(point).hinges, tool_of(point).tool, tool_points_[point]);
  }

  // What the contacts' forces do to a tool's springs: coordinates of the tool.
  Eigen::VectorXd springs_way(std::size_t tool) const {
    const Eigen::VectorXd compliance =
        coupling_compliance(tools_[tool].coupling, tools_[tool].hinges);
    Eigen::VectorXd pull = Eigen::VectorXd::Zero(compliance.size());
    for (std::size_t k = 0; k < active_.size(); ++k) {
      if (points_[active_[k]].tool != tool) continue;
      pull += jacobian(active_[k]).transpose() *
              (points_[active_[k]].axes * forces_.segment<3>(3 * Eigen::Index(k)));
    }
    return compliance.cwiseProduct(pull);
  }

  // C of the springs, and W of the tissue over a step, in the contacts' axes.
  void build_compliance() {
    std::vector<const CarriedPoint*> on_tissue;
    for (const std::size_t i : active_) on_tissue.push_back(&points_[i].on_tissue);
    const auto count = 3 * Eigen::Index(active_.size());
    Eigen::MatrixXd springs = Eigen::MatrixXd::Zero(count, count);
    for (std::size_t k = 0; k < tools_.size(); ++k) add_springs(k, springs);
    const Scalar period = body_.options().period;
    tissue_compliance_ = period * period * body_.response(on_tissue);
    problem_.friction = tools_[0].friction;
    problem_.compliance = springs + tissue_compliance_;
    turn_into_axes(tissue_compliance_);
    turn_into_axes(problem_.compliance);
    if (!active_.empty()) report_.springs_share = springs.trace() / problem_.compliance.trace();
  }

  // Of the contacts of a tool among each other.
  void add_springs(std::size_t tool, Eigen::MatrixXd& springs) const {
    std::vector<Eigen::Index> places;
    std::vector<ToolPoint> points;
    for (std::size_t k = 0; k < active_.size(); ++k) {
      if (points_[active_[k]].tool != tool) continue;
      places.push_back(3 * Eigen::Index(k));
      points.push_back(tool_points_[active_[k]]);
    }
    const JointTool& joint = tools_[tool];
    const Eigen::MatrixXd own =
        coupling_compliance(joint.coupling, joint.hinges, joint.tool, points);
    for (std::size_t i = 0; i < places.size(); ++i) {
      for (std::size_t k = 0; k < places.size(); ++k) {
        springs.block<3, 3>(places[i], places[k]) =
            own.block<3, 3>(3 * Eigen::Index(i), 3 * Eigen::Index(k));
      }
    }
  }

  void turn_into_axes(Eigen::MatrixXd& matrix) const {
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const Matrix3& axes = points_[active_[k]].axes;
      auto rows = matrix.middleRows<3>(3 * Eigen::Index(k));
      rows = (axes.transpose() * rows).eval();
      auto columns = matrix.middleCols<3>(3 * Eigen::Index(k));
      columns = (columns * axes).eval();
    }
  }

  // Where the springs would take the tool's points without contacts.
  void find_way_of_tool() {
    std::vector<Eigen::VectorXd> before;
    for (const JointTool& tool : tools_) {
      before.push_back(
          tool_displacement(tool.hinges.size(), tool.tool, tool.start.value_or(tool.tool)));
    }
    for (std::size_t i = 0; i < points_.size(); ++i) {
      JointPoint& point = points_[i];
      const Eigen::MatrixXd moves = jacobian(i);
      const Vector3 tissue = body_.place(point.on_tissue) - contacts_[numbers_[i]].p_WO;
      point.free = point.axes.transpose() * (moves * whole_[point.tool]);
      point.already = point.axes.transpose() * (moves * before[point.tool] - tissue);
    }
  }

  // Along the contact's axes, without the contacts' forces on the tool: along the normal the gap at
  // the end less the one wanted, along the tangents the tool's displacement relative to the tissue
  // in this step. What slipped before the step has slipped; undoing it would swing from step to
  // step.
  Vector3 apart(std::size_t i, const NodeVectors& v) const {
    const JointPoint& point = points_[i];
    const ToolContactPoint& contact = contacts_[numbers_[i]];
    const Vector3 tissue = body_.place(point.on_tissue) - contact.p_WO +
                           body_.options().period * TissueBody::sum_of(point.on_tissue, v);
    Vector3 one = point.free - point.axes.transpose() * tissue;
    one[0] += (contact.p_W - contact.p_WO).dot(point.axes.col(0)) - tool_of(i).rest_offset;
    one.tail<2>() -= point.already.tail<2>();
    return one;
  }

  // v has the tissue's answer to the present forces in it, but not that of the springs.
  void solve_contacts(const NodeVectors& v) {
    if (active_.empty()) return;
    ConeProblem problem = problem_;
    const Eigen::VectorXd softening = kSoftening * problem_.compliance.diagonal();
    problem.compliance.diagonal() += softening;
    Eigen::VectorXd free(forces_.size());
    for (std::size_t k = 0; k < active_.size(); ++k) {
      free.segment<3>(3 * Eigen::Index(k)) = apart(active_[k], v);
    }
    free -= tissue_compliance_ * forces_;
    for (int k = 0; k < kNearer; ++k) {
      problem.free = free - softening.cwiseProduct(forces_);
      problem.guess = forces_;
      const ConeAnswer answer = tissue_internal::solve_cones(problem);
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
  std::vector<Eigen::VectorXd> whole_;  // of each tool if it followed the device
  std::vector<std::size_t> numbers_;    // of the points' contacts
  std::vector<JointPoint> points_;
  std::vector<ToolPoint> tool_points_;
  std::vector<std::size_t> active_;  // points that may bear a force
  ConeProblem problem_;              // of these
  Eigen::MatrixXd tissue_compliance_;
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
