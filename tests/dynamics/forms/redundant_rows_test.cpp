// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "dynamics/step/link_rows.h"

namespace dyop::dynamics_internal {
namespace {

// Random chains and loops of bodies with rows that are sums of others: what is left must have the
// rank of all, by a singular value decomposition, and must not contradict itself.
class RandomLoop {
 public:
  explicit RandomLoop(std::uint64_t seed) : random_(seed) {
    movable_ = 2 + random_() % 4;
    for (std::size_t i = 0; i <= movable_; ++i) {
      ContactBody body;
      if (i < movable_) {
        body.inverse_mass_W = (0.5 + draw()) * Matrix3::Identity();
        const Matrix3 A = Matrix3::NullaryExpr([&] { return draw(); });
        body.inverse_inertia_W = A * A.transpose() + 0.1 * Matrix3::Identity();
      } else {
        body.inverse_mass_W.setZero();
        body.inverse_inertia_W.setZero();
      }
      bodies_.push_back(body);
    }
  }

  // A joint of `count` random rows that hold for a velocity field of the bodies.
  void add_joint(std::size_t a, std::size_t b, int count) {
    for (int k = 0; k < count; ++k) {
      JointRow row;
      row.body_a = a;
      row.body_b = b;
      for (Vector3* part : {&row.j_av_W, &row.j_aw_W, &row.j_bv_W, &row.j_bw_W}) {
        *part = Vector3::NullaryExpr([&] { return draw() - 0.5; });
      }
      add(row, 0.001 * draw());
    }
  }
  // The sum of the last rows, which asks for `misfit` more than they do.
  void repeat_last(int count, Scalar misfit) {
    JointRow sum = rows_.back();
    Scalar value = values_.back();
    for (std::size_t i = rows_.size() - std::size_t(count); i + 1 < rows_.size(); ++i) {
      sum.j_av_W += rows_[i].j_av_W;
      sum.j_aw_W += rows_[i].j_aw_W;
      sum.j_bv_W += rows_[i].j_bv_W;
      sum.j_bw_W += rows_[i].j_bw_W;
      value += values_[i];
    }
    ++joint_;
    add(sum, value + misfit);
  }

  std::vector<std::size_t> find() const {
    std::vector<HeldRow> held;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      held.push_back({joints_[i], &rows_[i], values_[i], 1});
    }
    return find_contradicting_rows(held, bodies_, movable_);
  }
  Eigen::Index rank(const std::vector<std::size_t>& left_out) const {
    Eigen::MatrixXd J =
        Eigen::MatrixXd::Zero(Eigen::Index(rows_.size()), Eigen::Index(6 * movable_));
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (std::find(left_out.begin(), left_out.end(), i) != left_out.end()) continue;
      const auto put = [&](std::size_t body, const Vector3& v, const Vector3& w) {
        if (body >= movable_) return;
        J.row(Eigen::Index(i)).segment<3>(Eigen::Index(6 * body)) += v.transpose();
        J.row(Eigen::Index(i)).segment<3>(Eigen::Index(6 * body + 3)) += w.transpose();
      };
      put(rows_[i].body_a, rows_[i].j_av_W, rows_[i].j_aw_W);
      put(rows_[i].body_b, rows_[i].j_bv_W, rows_[i].j_bw_W);
    }
    Eigen::JacobiSVD<Eigen::MatrixXd> svd(J);
    svd.setThreshold(1e-9);
    return svd.rank();
  }
  std::size_t movable() const { return movable_; }
  std::size_t row_count() const { return rows_.size(); }
  void next_joint() { ++joint_; }
  std::uint64_t number() { return random_(); }

 private:
  void add(const JointRow& row, Scalar value) {
    rows_.push_back(row);
    values_.push_back(value);
    joints_.push_back(joint_);
  }
  Scalar draw() { return std::uniform_real_distribution<Scalar>(0, 1)(random_); }

  std::mt19937_64 random_;
  std::size_t movable_ = 0;
  std::vector<ContactBody> bodies_;
  std::vector<JointRow> rows_;
  std::vector<Scalar> values_;
  std::vector<std::size_t> joints_;
  std::size_t joint_ = 0;
};

TEST(RedundantRows, LeavesRowsOfFullRank) {
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    for (const Scalar misfit : {0., 1e-4}) {
      RandomLoop loop(seed);
      loop.add_joint(0, loop.movable(), 3);  // to the ground
      for (std::size_t body = 1; body < loop.movable(); ++body) {
        loop.next_joint();
        loop.add_joint(body - 1, body, 2 + int(loop.number() % 3));
      }
      loop.repeat_last(2, misfit);
      const std::vector<std::size_t> left_out = loop.find();
      if (misfit == 0) {
        EXPECT_TRUE(left_out.empty()) << seed;
      } else {
        ASSERT_EQ(left_out.size(), 1u) << seed;
        EXPECT_EQ(left_out.front(), loop.row_count() - 1) << seed;
        EXPECT_EQ(loop.rank(left_out), loop.rank({})) << seed;
        EXPECT_EQ(loop.rank(left_out), Eigen::Index(loop.row_count() - 1)) << seed;
      }
    }
  }
}

TEST(RedundantRows, KeepsTreesWhateverTheyAskFor) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    RandomLoop chain(seed);
    chain.add_joint(0, chain.movable(), 6);
    for (std::size_t body = 1; body < chain.movable(); ++body) {
      chain.next_joint();
      chain.add_joint(body - 1, body, 5);
    }
    EXPECT_TRUE(chain.find().empty()) << seed;
  }
}

}  // namespace
}  // namespace dyop::dynamics_internal
