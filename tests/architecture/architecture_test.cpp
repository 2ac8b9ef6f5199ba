// Rules of the code base that no compiler checks: who may include whom, where constants live, which
// packages the build may ask for, and that the README shows code that is compiled.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = DYOP_SOURCE_DIR;

std::string read_text(const fs::path& path) {
  std::ifstream in(path);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::vector<std::string> read_lines(const fs::path& path) {
  std::ifstream in(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::vector<fs::path> code_files(const std::vector<std::string>& folders) {
  std::vector<fs::path> files;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(kRoot / folder)) {
      const std::string extension = entry.path().extension().string();
      if (extension == ".h" || extension == ".cpp") files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The ladder: a room may include itself and rooms of a lower level. geometry and motion share a
// level and do not know each other.
const std::map<std::string, int> kLevel{{"core", 0},     {"geometry", 1}, {"motion", 1},
                                        {"distance", 2}, {"toi", 3},      {"contact", 4},
                                        {"dynamics", 5}, {"io", 6},       {"cli", 7}};

bool may_include(const std::string& from, const std::string& to) {
  return from == to || kLevel.at(to) < kLevel.at(from);
}

// The room of a file below include/dyop/ or src/.
std::string room_of(const fs::path& path) {
  const fs::path relative = fs::relative(path, kRoot);
  auto part = relative.begin();
  if (*part == "include") ++part;
  return std::next(part)->string();
}

TEST(Ladder, HasEveryRoomThatExists) {
  for (const char* folder : {"include/dyop", "src"}) {
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) {
      if (entry.is_directory()) {
        EXPECT_TRUE(kLevel.contains(entry.path().filename().string())) << entry.path();
      }
    }
  }
}

TEST(Ladder, IncludesPointDownOnly) {
  const std::regex include("^#include \"(?:dyop/)?([a-z_]+)/[^\"]+\"");
  int checked = 0;
  for (const fs::path& file : code_files({"include", "src"})) {
    const std::string room = room_of(file);
    for (const std::string& line : read_lines(file)) {
      std::smatch match;
      if (!std::regex_search(line, match, include)) continue;
      ASSERT_TRUE(kLevel.contains(match[1].str())) << file << ": " << line;
      EXPECT_TRUE(may_include(room, match[1].str())) << file << ": " << line;
      ++checked;
    }
  }
  EXPECT_GT(checked, 100);
}

TEST(Ladder, TheRuleItselfRefusesUpAndSideways) {
  EXPECT_TRUE(may_include("toi", "core"));
  EXPECT_FALSE(may_include("core", "toi"));
  EXPECT_FALSE(may_include("geometry", "motion"));
}

// Numerical constants live in core/tolerance.h; elsewhere a floating literal below 1e-3 needs a
// reason on its line or just above.
std::vector<std::string> unexplained_literals(const std::vector<std::string>& lines) {
  const std::regex literal("[^A-Za-z0-9_.]([0-9]+\\.?[0-9]*e-[0-9]+|0\\.000[0-9]+)");
  std::vector<std::string> found;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string without_text = std::regex_replace(lines[i], std::regex("\"[^\"]*\""), "");
    const std::string code = without_text.substr(0, without_text.find("//"));
    std::smatch match;
    if (!std::regex_search(code, match, literal) || std::stod(match[1].str()) >= 1e-3) continue;
    bool has_reason = false;
    for (std::size_t back = 0; back <= 3 && back <= i; ++back) {
      has_reason = has_reason || lines[i - back].find("literal:") != std::string::npos;
    }
    if (!has_reason) found.push_back(lines[i]);
  }
  return found;
}

TEST(Constants, LiveInOneHome) {
  for (const fs::path& file : code_files({"include", "src"})) {
    if (file.filename() == "tolerance.h") continue;
    for (const std::string& line : unexplained_literals(read_lines(file))) {
      ADD_FAILURE() << file << ": literal without a reason: " << line;
    }
  }
}

TEST(Constants, TheRuleItselfFindsOne) {
  EXPECT_EQ(unexplained_literals({"if (x < 1e-12) return;"}).size(), 1u);
  EXPECT_EQ(unexplained_literals({"x = y * 0.0001;"}).size(), 1u);
  EXPECT_TRUE(unexplained_literals({"// literal: why", "if (x < 1e-12) return;"}).empty());
  EXPECT_TRUE(unexplained_literals({"x = 0.5 * 1e-2;"}).empty());
}

TEST(Headers, AreListedInTheirRoom) {
  for (const fs::path& file : code_files({"include"})) {
    const std::string list = read_text(kRoot / "src" / room_of(file) / "CMakeLists.txt");
    const std::regex stem("\\b" + file.stem().string() + "\\b");
    EXPECT_TRUE(std::regex_search(list, stem)) << file << " is not installed";
  }
}

TEST(Headers, AreIncludedByATestOfTheirRoom) {
  // Plain data and bases come with the headers that use them.
  const std::set<std::string> plain{"types",      "shape",      "triangle",
                                    "toi_result", "rigid_body", "sundials_integrator",
                                    "chart_curve"};
  for (const fs::path& file : code_files({"include"})) {
    const std::string room = room_of(file);
    if (plain.contains(file.stem().string())) continue;
    const std::string include = "#include \"dyop/" + room + "/" + file.filename().string() + "\"";
    bool is_included = false;
    for (const fs::path& test : code_files({"tests/" + room})) {
      is_included = is_included || read_text(test).find(include) != std::string::npos;
    }
    EXPECT_TRUE(is_included) << file << " is not included by any test of its room";
  }
}

TEST(Packages, TheBuildAsksForListedOnesOnly) {
  const std::string list = read_text(kRoot / ".ci/install.sh");
  const std::regex find("dyop_find\\(\\w+ ([a-z0-9.+-]+)");
  int checked = 0;
  for (const char* name : {"src/CMakeLists.txt", "tests/CMakeLists.txt"}) {
    const std::string text = read_text(kRoot / name);
    for (auto match = std::sregex_iterator(text.begin(), text.end(), find);
         match != std::sregex_iterator(); ++match) {
      const std::string package = (*match)[1];
      if (package == "libc6-dev") continue;  // comes with every compiler
      EXPECT_TRUE(std::regex_search(list, std::regex("\\b" + package + "\\b"))) << package;
      ++checked;
    }
  }
  EXPECT_GT(checked, 6);
}

TEST(Readme, ShowsTheConsumerThatIsCompiled) {
  const std::string readme = read_text(kRoot / "README.md");
  const std::string consumer = read_text(kRoot / "tests/consumer/find_package/main.cpp");
  EXPECT_NE(readme.find(consumer), std::string::npos)
      << "README.md must hold tests/consumer/find_package/main.cpp word for word";
}

TEST(TopLevel, HoldsOnlyWhatToolsInsistOn) {
  const std::set<std::string> allowed{".ci",
                                      ".clang-format",
                                      ".clang-tidy",
                                      ".git",
                                      ".gitignore",
                                      "CMakeLists.txt",
                                      "CMakePresets.json",
                                      "LICENSE",
                                      "README.md",
                                      "build",
                                      "docs",
                                      "examples",
                                      "include",
                                      "src",
                                      "tests"};
  for (const auto& entry : fs::directory_iterator(kRoot)) {
    EXPECT_TRUE(allowed.contains(entry.path().filename().string())) << entry.path();
  }
}

}  // namespace
