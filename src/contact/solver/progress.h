// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dyop/core/types.h"

namespace dyop::contact_internal {

/// Whether an iteration still gets on: it halves its residual within so many steps as its patience.
class Progress {
 public:
  Progress(Scalar residual, int patience) : at_mark_(residual), patience_(patience) {}

  /// After `done` steps in all, with the least residual so far.
  bool has_stalled(int done, Scalar residual) {
    if (done - mark_ < patience_) return false;
    if (!(residual <= at_mark_ / 2)) return true;
    mark_ = done;
    at_mark_ = residual;
    return false;
  }

 private:
  Scalar at_mark_;
  int mark_ = 0;
  int patience_;
};

}  // namespace dyop::contact_internal
