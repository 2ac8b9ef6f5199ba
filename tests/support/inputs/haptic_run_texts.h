// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace dyop::testing {

/// A scene of `dyop tool`: a rod with a jaw over a small breathing liver, beside a vessel.
inline constexpr const char* kSmallHapticScene = R"({
  "tool": {
    "position": [0, 0, 80],
    "hinges": [{"rotation": [-1.5707963267948966, 0, 0], "angle": 0.3, "stiffness": 500}],
    "parts": [
      {"shaft": {"triangles": 200, "radius": 2.5, "length": 50}, "position": [0, 0, 1]},
      {"jaw": {"triangles": 100, "radius": 2.4, "length": 18}, "hinge": 1}
    ]
  },
  "obstacles": [
    {"name": "liver", "role": "tissue", "friction": 0.2, "liver": {"triangles": 1000},
     "breathing": {"frequency": 1, "amplitude": [2, 0, 6], "rate": 50}},
    {"name": "vessel", "role": "hard", "margin": 2, "vessel": {"triangles": 500},
     "position": [0, 40, 45]}
  ],
  "coupling": {"stiffness": 0.5, "damping": 0.0005, "rotational_stiffness": 2000,
               "rotational_damping": 2, "device_damping": 0.001, "device_rotational_damping": 4},
  "rest_offset": 0.05,
  "recovery_speed": 50,
  "rate": 1000,
  "duration": 2,
  "strokes": [
    {"name": "down", "path": [
      {"t": 0, "position": [0, 0, 80], "angles": [0.3]},
      {"t": 0.2, "position": [0, 0, 45], "angles": [0]},
      {"t": 0.3, "position": [0, 0, 80], "angles": [0.3]}]},
    {"name": "aside", "path": [
      {"t": 0, "position": [0, 0, 80], "angles": [0.3]},
      {"t": 0.2, "position": [10, 40, 50], "rotation": [0.2, 0, 0], "angles": [0]},
      {"t": 0.4, "position": [0, 0, 80], "angles": [0.3]}]}
  ]
})";

/// The text with its first `from` replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

/// The scene with its liver's top cut off with snapshot 5, and with further cuts.
inline std::string cut_haptic_scene(const std::string& further = {}) {
  const std::string top =
      R"("rate": 50, "cuts": [{"t": 0.1, "position": [0, 0, 35], "radius": 20})";
  return replaced(kSmallHapticScene, "\"rate\": 50}",
                  top + (further.empty() ? "" : ", ") + further + "]}");
}

/// The scene with a liver that answers the tool.
inline std::string elastic_haptic_scene() {
  return replaced(kSmallHapticScene,
                  R"("breathing": {"frequency": 1, "amplitude": [2, 0, 6], "rate": 50})",
                  R"("elastic": {"youngs_modulus": 0.005, "poissons_ratio": 0.45,
                     "density": 1.05e-9, "viscosity": 0.05, "cube": 20, "rate": 50,
                     "fixed": [{"min": [-99, -99, -99], "max": [99, 99, -20]}]})");
}

/// The scene with a second tool, a rod on softer springs, that comes from the side, meets the first
/// and goes back.
inline std::string two_tools_haptic_scene() {
  const std::string rod = R"("more_tools": [{
      "position": [40, 0, 80],
      "parts": [{"shaft": {"triangles": 100, "radius": 2, "length": 50}}],
      "coupling": {"stiffness": 0.2, "rotational_stiffness": 500}
    }],
    "tool_margin": 0.1,
    "tool_friction": 0.2,
    "obstacles")";
  std::string text = replaced(kSmallHapticScene, "\"obstacles\"", rod);
  const std::string there = R"("angles": [0.3]}],
     "more_paths": [[
      {"t": 0, "position": [40, 0, 80], "angles": []},
      {"t": 0.1, "position": [0, 0, 75], "angles": []},
      {"t": 0.3, "position": [40, 0, 80], "angles": []}]]},
    {"name": "aside")";
  text = replaced(text, "\"angles\": [0.3]}]},\n    {\"name\": \"aside\"", there);
  const std::string stays = R"("angles": [0.3]}],
     "more_paths": [[
      {"t": 0, "position": [40, 0, 80], "angles": []},
      {"t": 0.1, "position": [60, 0, 80], "angles": []}]]}
  ])";
  return replaced(text, "\"angles\": [0.3]}]}\n  ]", stays);
}

}  // namespace dyop::testing
