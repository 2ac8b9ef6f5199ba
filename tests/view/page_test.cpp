// SPDX-License-Identifier: BSD-3-Clause
// The page in a real browser: check_page.mjs compares it with the World's own motions.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "dyop/distance/distance.h"
#include "dyop/geometry/primitives.h"
#include "dyop/io/scene_file.h"
#include "dyop/motion/steady_motions.h"
#include "dyop/view/live_server.h"
#include "dyop/view/run_files.h"
#include "support/temporary_directory.h"
#include "view/browser_check.h"
#include "view/page_case.h"

namespace dyop {
namespace {

using testing::PageCase;

void expect_scene_shown(const std::string& kind, int n, Scalar end_time) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const auto file = directory.path() / "scene.json";
  write_generated_scene(generate_scene(kind, n), file);
  const PageCase run = testing::run_page_case(load_scene(file), end_time);
  ASSERT_FALSE(run.impacts.empty());
  testing::expect_page_shows(kind, page_html(run.scene.title, run.blocks), run.facts(10000));
}

TEST(Page, ShowsACradleAsItRan) {
  expect_scene_shown("cradle", 5, 3);
}

TEST(Page, ShowsFallingBoxesInAPit) {
  expect_scene_shown("pile", 12, 1.5);
}

TEST(Page, PlaysInFirefox) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  const testing::TemporaryDirectory directory;
  const auto file = directory.path() / "scene.json";
  write_generated_scene(generate_scene("cradle", 3), file);
  const PageCase run = testing::run_page_case(load_scene(file), 1);
  testing::expect_plays_in_firefox("firefox", page_html(run.scene.title, run.blocks));
}

// Pairs of round bodies, a thousand lengths from the origin, each 1e-4 apart: a hundredth of what
// facets leave out, and a sixth of what single precision knows of their place.
TEST(Page, DrawsRoundBodiesRoundInACloseUp) {
  if (const std::string why = testing::reason_to_skip_browser(); !why.empty()) GTEST_SKIP() << why;
  constexpr Scalar kGap = 1e-4;
  const Vector3 far_off(1000, -700, 300);
  const auto ball = std::make_shared<Sphere>(0.5);
  const std::vector<std::shared_ptr<const Shape>> others{
      std::make_shared<Sphere>(0.7),
      std::make_shared<Box>(Vector3(0.4, 0.5, 0.6)),
      std::make_shared<Capsule>(0.3, 0.4),
      std::make_shared<Cylinder>(0.4, 0.5),
      std::make_shared<Cone>(0.5, 0.4),
      std::make_shared<Ellipsoid>(Vector3(0.4, 0.6, 0.5)),
      std::make_shared<RoundedBox>(Vector3(0.2, 0.3, 0.4), 0.2),
      std::make_shared<RoundedCylinder>(0.3, 0.4, 0.2),
      std::make_shared<TaperedCapsule>(0.5, 0.3, 0.4)};
  PageScene scene;
  PageSpan span;
  nlohmann::json facts;
  for (std::size_t k = 0; k < others.size(); ++k) {
    const Scalar t = Scalar(k) + 1;
    const RigidPose X_WA(rotation_from_vector(Vector3(0.3, -0.5, 0.2 * t)),
                         far_off + Vector3(0, 4 * t, 0));
    const Vector3 way = Vector3(1, 0.3, 0.4).normalized();
    RigidPose X_WB(Matrix3::Identity(), X_WA.translation() + 3 * way);
    X_WB = RigidPose(
        X_WB.rotation(),
        X_WB.translation() - (distance(*others[k], X_WA, *ball, X_WB).lower - kGap) * way);
    // The way is not the normal: a few steps close the rest.
    for (int round = 0; round < 60; ++round) {
      const DistanceResult found = distance(*others[k], X_WA, *ball, X_WB);
      const Vector3 normal = (found.p_WCb - found.p_WCa).normalized();
      X_WB = RigidPose(X_WB.rotation(), X_WB.translation() - (found.upper - kGap) * normal);
    }
    const DistanceResult found = distance(*others[k], X_WA, *ball, X_WB);
    ASSERT_NEAR(found.upper, kGap, 0.01 * kGap);
    scene.bodies.push_back({"other " + std::to_string(k), BodyKind::Dynamic, others[k], "", {}});
    scene.bodies.push_back({"ball " + std::to_string(k), BodyKind::Dynamic, ball, "", {}});
    const TimeInterval all{0, Scalar(others.size())};
    span.segments.push_back({BodyId(2 * k), all, std::make_shared<RestMotion>(X_WA)});
    span.segments.push_back({BodyId(2 * k + 1), all, std::make_shared<RestMotion>(X_WB)});
    PageFrame frame;
    frame.interval = {t - 1, t};
    span.frames.push_back(frame);
    span.steps.push_back(frame.interval);
    PageGap gap;
    gap.t = t;
    gap.a = BodyId(2 * k);
    gap.b = BodyId(2 * k + 1);
    gap.lower = found.lower;
    gap.upper = found.upper;
    // Those of two balls follow from their places, if none are recorded.
    if (k > 0) gap.witness_W = {found.p_WCa, found.p_WCb};
    gap.pivot_W = (found.p_WCa + found.p_WCb) / 2;
    span.gaps.push_back(gap);
    facts["gaps"].push_back({{"t", t}, {"gap", found.upper}});
  }
  scene.end_time = Scalar(others.size());
  const PageEncoder encoder(scene);
  const std::vector<std::string> blocks{encoder.head(), encoder.span(span)};
  const auto folder = std::filesystem::path(DYOP_PAGE_OUTPUT);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "close_up.html", std::ios::binary) << page_html("Close up", blocks);
  std::ofstream(folder / "close_up.json") << facts.dump();
  testing::expect_script_passes(
      "close_up", "check_views.mjs",
      {"close_up", (folder / "close_up.json").string(), (folder / "close_up.html").string()});
}

}  // namespace
}  // namespace dyop
