// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "dyop/ompl/ompl_motion_validator.h"

namespace dyop::ompl_internal {

/// What is known about a motion.
struct EdgeVerdict {
  bool is_free = false;  ///< proven, all of it
  Scalar t_safe = 0;     ///< of [0, 1], proven free up to here
};

/// Proves one kind of motion. Thread-safe.
class EdgeCheck {
 public:
  virtual ~EdgeCheck() = default;

  virtual EdgeVerdict examine(const ompl::base::State* from, const ompl::base::State* to) const = 0;
};

std::unique_ptr<const EdgeCheck> make_body_check(std::shared_ptr<const Shape> body,
                                                 std::shared_ptr<const ObstacleSet> obstacles,
                                                 const OmplOptions& options);
std::unique_ptr<const EdgeCheck> make_chain_check(std::shared_ptr<const KinematicChain> chain,
                                                  std::shared_ptr<const ObstacleSet> obstacles,
                                                  const OmplOptions& options);
std::unique_ptr<const EdgeCheck> make_bodies_check(OmplMotionValidator::Bodies bodies,
                                                   std::shared_ptr<const ObstacleSet> obstacles,
                                                   const OmplOptions& options);

/// A pool of workspaces: as many as there have been simultaneous queries.
template <typename Workspace>
class WorkspacePool {
 public:
  /// A workspace for exclusive use, returned to the pool by the destructor.
  class Loan {
   public:
    explicit Loan(WorkspacePool& pool) : pool_(pool), workspace_(pool.take()) {}
    ~Loan() { pool_.give_back(std::move(workspace_)); }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    Workspace& operator*() { return *workspace_; }

   private:
    WorkspacePool& pool_;
    std::unique_ptr<Workspace> workspace_;
  };

 private:
  std::unique_ptr<Workspace> take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<Workspace>();
    std::unique_ptr<Workspace> workspace = std::move(idle_.back());
    idle_.pop_back();
    return workspace;
  }
  void give_back(std::unique_ptr<Workspace> workspace) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(workspace));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> idle_;
};

}  // namespace dyop::ompl_internal
