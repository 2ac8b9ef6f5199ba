// SPDX-License-Identifier: BSD-3-Clause
#include "contact/solver/sweep_kernels.h"
#include "core/simd.h"

// The kernels of sweep_kernels.h for the instruction set that this file is compiled for.
namespace dyop::contact_internal {
inline namespace DYOP_LANES {

/// As kContactSlideNoise and kContactSlideLimit of tolerance.h.
constexpr double kSlideNoise = 0x1p-49;  // literal: 16 units of rounding
constexpr int kSlideLimit = 100;

/// Relative velocities of the contacts in some lanes of a group.
template <typename L>
DYOP_INLINE void relative_velocities(const SweepGroup& group, int first, const double* velocities,
                                     L* u) {
  const int* body_a = group.body_a + first;
  const int* body_b = group.body_b + first;
  L sum_a[3] = {L(0.0), L(0.0), L(0.0)};
  L sum_b[3] = {L(0.0), L(0.0), L(0.0)};
  for (int k = 0; k < 6; ++k) {
    const L y_a = L::gather(velocities + k, body_a);
    const L y_b = L::gather(velocities + k, body_b);
    for (int i = 0; i < 3; ++i) {
      sum_a[i] = sum_a[i] + L::load(group.G_a[6 * i + k] + first) * y_a;
      sum_b[i] = sum_b[i] + L::load(group.G_b[6 * i + k] + first) * y_b;
    }
  }
  for (int i = 0; i < 3; ++i) u[i] = L::load(group.free[i] + first) + (sum_a[i] + sum_b[i]);
}

/// y += G^T change, for one of the bodies.
template <typename L>
DYOP_INLINE void push(const double (*G)[kSweepWidth], const int* bodies, int first, const L* change,
                      double* velocities) {
  for (int k = 0; k < 6; ++k) {
    L y = L::gather(velocities + k, bodies + first);
    y = y + ((L::load(G[k] + first) * change[0] + L::load(G[6 + k] + first) * change[1]) +
             L::load(G[12 + k] + first) * change[2]);
    y.scatter(velocities + k, bodies + first);
  }
}

/// Impulses that would stick at a mobility A + slip along the tangents.
template <typename L>
struct SlidingTrial {
  L factor, diagonal_0, diagonal_1, across;

  DYOP_INLINE SlidingTrial(const L* A, L slip) {
    diagonal_0 = A[0] + slip;
    diagonal_1 = A[2] + slip;
    across = A[1];
    factor = L(1.0) / (diagonal_0 * diagonal_1 - across * across);
  }
  DYOP_INLINE void apply(const L* x, L* out) const {
    out[0] = (diagonal_1 * x[0] - across * x[1]) * factor;
    out[1] = (diagonal_0 * x[1] - across * x[0]) * factor;
  }
};

template <typename L>
DYOP_INLINE L length(const L* x) {
  return sqrt(x[0] * x[0] + x[1] * x[1]);
}

/// slide() of contact_law.cpp in the lanes of the mask; others keep their p and slip.
template <typename L>
DYOP_INLINE void slide(const L* A, const L* b, L c0, const L* c, typename L::Mask active, L& slip,
                       L* p) {
  const L zero(0.0);
  L low = zero;
  L high(__builtin_inf());
  L x = larger(slip, zero);
  for (int i = 0; i < kSlideLimit && active.bits() != 0; ++i) {
    const SlidingTrial<L> trial(A, x);
    L t[2], dt[2];
    trial.apply(b, t);
    const L size = length(t);
    const L bound = c0 + (c[0] * t[0] + c[1] * t[1]);
    const L excess = bound - size;
    for (int k = 0; k < 2; ++k) p[k] = select(active, t[k], p[k]);
    slip = select(active, x, slip);
    active = without(active, L(kSlideNoise) * size >= magnitude(excess));
    low = select(zero > excess, x, low);
    high = select(zero > excess, high, x);
    trial.apply(t, dt);
    const L slope =
        bound * (t[0] * dt[0] + t[1] * dt[1]) / (size * size) - (c[0] * dt[0] + c[1] * dt[1]);
    const L newton = x - excess / slope;
    const L half =
        select(L(__builtin_inf()) > high, (low + high) * L(0.5), (x + x) + (A[0] + A[2]));
    const L next = select((newton > low) & (high > newton), newton, half);
    active = without(active, (next >= x) & (x >= next));
    x = next;
  }
}

/// LocalContact::solve_coupled(), where wanted, for normal impulses that are not zero.
template <typename L>
DYOP_INLINE void solve_coupled(const SweepGroup& group, int first, const L* q, L* lambda, L& slip,
                               typename L::Mask wanted) {
  const L zero(0.0);
  const L noise = L::load(group.noise + first);
  const L inverse = L::load(group.normal_inverse + first);
  const L friction = L::load(group.friction + first);
  const L W_10 = L::load(group.W[1] + first);
  const L W_20 = L::load(group.W[3] + first);
  const L coupling[2] = {W_10 * inverse, W_20 * inverse};
  // Mobility along the tangents with the normal velocity held at zero.
  const L A[3] = {(L::load(group.W[2] + first) - coupling[0] * W_10) + noise,
                  L::load(group.W[4] + first) - coupling[0] * W_20,
                  (L::load(group.W[5] + first) - coupling[1] * W_20) + noise};
  const L normal = zero - q[0] * inverse;
  const L b[2] = {coupling[0] * q[0] - q[1], coupling[1] * q[0] - q[2]};
  L p[2];
  SlidingTrial<L>(A, zero).apply(b, p);
  L n = normal - (coupling[0] * p[0] + coupling[1] * p[1]);
  const L most = friction * n;
  const auto sticks = (most * most >= p[0] * p[0] + p[1] * p[1]) & (n >= zero);
  const auto slides = without(wanted & (friction > zero), sticks);
  slip = select(sticks, zero, slip);
  if (slides.bits() != 0) {
    const L c[2] = {zero - friction * coupling[0], zero - friction * coupling[1]};
    slide(A, b, friction * normal, c, slides, slip, p);
    const L sliding_n = larger(normal - (coupling[0] * p[0] + coupling[1] * p[1]), zero);
    n = select(slides, sliding_n, n);
    const L bound = friction * n;  // rounding cannot leave the cone
    const L size = length(p);
    const L shrink = select(size > bound, bound / size, L(1.0));
    for (int k = 0; k < 2; ++k) p[k] = p[k] * shrink;
  }
  const auto has_friction = friction > zero;
  lambda[0] = select(has_friction, n, normal);
  for (int k = 0; k < 2; ++k) lambda[k + 1] = select(has_friction, p[k], zero);
}

/// LocalContact::solve().
template <typename L>
DYOP_INLINE void solve(const SweepGroup& group, int first, const L* q, L* lambda, L& slip) {
  const L zero(0.0);
  const L friction = L::load(group.friction + first);
  const L tangential = L::load(group.tangential + first);
  const L normal = zero - q[0] * L::load(group.normal_inverse + first);
  const L bound = friction * normal;
  const L sliding = length(q + 1);
  const L shrink = select(tangential * bound >= sliding, L::load(group.tangential_inverse + first),
                          bound / sliding);
  lambda[0] = normal;
  lambda[1] = zero - q[1] * shrink;
  lambda[2] = zero - q[2] * shrink;
  const auto separates = q[0] >= zero;
  if (group.has_coupled) {
    const auto is_coupled = L::load(group.is_coupled + first) > zero;
    L coupled[3];
    L coupled_slip = slip;
    solve_coupled(group, first, q, coupled, coupled_slip, without(is_coupled, separates));
    slip = select(is_coupled, coupled_slip, slip);
    for (int i = 0; i < 3; ++i) lambda[i] = select(is_coupled, coupled[i], lambda[i]);
  }
  slip = select(separates, zero, slip);
  for (int i = 0; i < 3; ++i) lambda[i] = select(separates, zero, lambda[i]);
}

/// Solves the contacts in some lanes of a group; returns by how much their velocities change.
template <typename L>
DYOP_INLINE L relax(SweepGroup& group, int first, double* velocities) {
  L u[3];
  relative_velocities(group, first, velocities, u);
  L W[6], lambda[3], before[3], change[3];
  for (int i = 0; i < 6; ++i) W[i] = L::load(group.W[i] + first);
  for (int i = 0; i < 3; ++i) before[i] = L::load(group.lambda[i] + first);
  const L q[3] = {u[0] - ((W[0] * before[0] + W[1] * before[1]) + W[3] * before[2]),
                  u[1] - ((W[1] * before[0] + W[2] * before[1]) + W[4] * before[2]),
                  u[2] - ((W[3] * before[0] + W[4] * before[1]) + W[5] * before[2])};
  L slip = L::load(group.slip + first);
  solve(group, first, q, lambda, slip);
  slip.store(group.slip + first);
  for (int i = 0; i < 3; ++i) {
    change[i] = lambda[i] - before[i];
    lambda[i].store(group.lambda[i] + first);
  }
  push(group.G_a, group.body_a, first, change, velocities);
  push(group.G_b, group.body_b, first, change, velocities);
  return L::load(group.weight + first) * sqrt(dot(change, change));
}

template <typename L>
DYOP_INLINE double largest_lane(L x) {
  double lanes[L::kCount];
  x.store(lanes);
  double largest = 0;
  for (int k = 0; k < L::kCount; ++k) largest = lanes[k] > largest ? lanes[k] : largest;
  return largest;
}

static double sweep_lanes(SweepGroup* groups, int count, double* velocities) {
  using L = FewLanes;
  L largest(0.0);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      for (int w = 0; w < kSweepWidth; ++w) groups[i].before[k][w] = groups[i].lambda[k][w];
    }
    for (int first = 0; first < kSweepWidth; first += L::kCount) {
      largest = larger(relax<L>(groups[i], first, velocities), largest);
    }
  }
  for (int i = count; i-- > 0;) {
    for (int first = 0; first < kSweepWidth; first += L::kCount) {
      largest = larger(relax<L>(groups[i], first, velocities), largest);
    }
  }
  return largest_lane(largest);
}

/// How far lambda is from the point of the cone nearest to lambda - u~ / weight, as a velocity.
template <typename L>
DYOP_INLINE L residuals(const SweepGroup& group, int first, const double* velocities) {
  const L zero(0.0);
  L u[3], lambda[3], x[3];
  relative_velocities(group, first, velocities, u);
  const L friction = L::load(group.friction + first);
  const L weight = L::load(group.weight + first);
  const L rho = L(1.0) / weight;
  u[0] = u[0] + friction * length(u + 1);
  for (int i = 0; i < 3; ++i) {
    lambda[i] = L::load(group.lambda[i] + first);
    x[i] = lambda[i] - rho * u[i];
  }
  const L t = length(x + 1);
  const auto is_inside = (x[0] >= zero) & (friction * x[0] >= t);
  const L n = (x[0] + friction * t) / (L(1.0) + friction * friction);
  const L shrink = friction * n / t;
  const auto is_opposite = zero - x[0] >= friction * t;
  L away[3];
  for (int i = 0; i < 3; ++i) {
    const L on_edge = i == 0 ? n : x[i] * shrink;
    away[i] = lambda[i] - select(is_inside, x[i], select(is_opposite, zero, on_edge));
  }
  return (sqrt(dot(away, away)) + L(kResidualNoise) * sqrt(dot(lambda, lambda))) * weight;
}

static double residual_lanes(const SweepGroup* groups, int count, const double* velocities) {
  using L = FewLanes;
  L largest(0.0);
  L lost(0.0);  // NaN if some residual is not finite, else zero
  for (int i = 0; i < count; ++i) {
    for (int first = 0; first < kSweepWidth; first += L::kCount) {
      const L here = residuals<L>(groups[i], first, velocities);
      largest = larger(here, largest);
      lost = lost + (here - here);
    }
  }
  double lanes[L::kCount];
  lost.store(lanes);
  double result = largest_lane(largest);
  for (int k = 0; k < L::kCount; ++k) result = result + lanes[k];
  return result;
}

}  // namespace DYOP_LANES

extern const SweepKernels DYOP_KERNEL(sweep_kernels);
const SweepKernels DYOP_KERNEL(sweep_kernels) = {sweep_lanes, residual_lanes};

}  // namespace dyop::contact_internal
