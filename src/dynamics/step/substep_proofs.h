// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "dynamics/step/island_run.h"

namespace dyop::dynamics_internal {

/// The proofs of all pairs of an island for one substep, round after round from the same start.
class SubstepProofs {
 public:
  SubstepProofs(IslandRun& run, Scalar tau) : run_(run), tau_(tau) {}

  /// Proves what can be proven of moves with constant twists, by member. A pair whose bodies move
  /// nearly as they did when it was last proven keeps that proof: from the second round on queries
  /// ask for a margin more than is kept. No point of a body is farther than t (|dv| + |dw| r) from
  /// where it was at time t of a twist that differs by dv and dw, so a sum over both bodies below
  /// the margin is enough.
  void find(const std::vector<BodyMove>& moves);

  /// By pair.
  const std::vector<Certificate>& certificates() const { return certificates_; }
  bool is_complete() const { return hits_ == 0; }
  /// Whether so many pairs are left, and hardly fewer than in the round before, that a shorter substep
  /// is sooner found than the rest of their answers.
  bool is_hopeless() const;
  /// The pair that is hit first, if some is.
  std::size_t first_hit() const;

 private:
  struct Proven {  // twists of the last proof, and what it has to spare
    BodyMove a;
    BodyMove b;
    Scalar margin = 0;
  };

  bool still_holds(std::size_t pair, const BodyMove& a, const BodyMove& b) const;
  Certificate prove(std::size_t pair, const BodyMove& a, const BodyMove& b);

  IslandRun& run_;
  Scalar tau_;
  std::vector<Certificate> certificates_;
  std::vector<Proven> proven_;  // by pair
  int rounds_ = 0;
  std::size_t hits_ = 0;
  std::size_t last_hits_ = 0;  // of the round before
};

}  // namespace dyop::dynamics_internal
