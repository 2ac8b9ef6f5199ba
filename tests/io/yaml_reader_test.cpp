// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "dyop/io/file_error.h"
#include "io/json_reader.h"

namespace dyop::io_internal {
namespace {

Json parse(const std::string& text) {
  return parse_yaml("f.yaml", text);
}

std::string message_of(const std::string& text) {
  try {
    parse(text);
  } catch (const FileError& error) {
    return error.what();
  }
  return "no error";
}

TEST(YamlReader, ReadsWhatRobotSoftwareWrites) {
  const Json json = parse(R"(%YAML 1.2
---
name: "a \"b\""   # a remark
'it''s': 'it''s'
empty:
none: ~
flags: [true, false]
numbers:
- 1
- -2.5
- +3e2
- .5
deep: [[1, [2, 3]],
   # within brackets
   {x: 1, "y": -0, z: [a b, c]}]
objects:
  - id: Can1
    primitives:
      - type: cylinder
        dimensions: [0.14, 0.03]
    pose:
      position: {x: 1, y: 2, z: 3}
  -
    id: 007 apples
  - - 1
    - 2
url: package://a/b.stl#c
time: 12:30
last: 0x10
...
)");
  EXPECT_EQ(
      json.dump(),
      R"({"name":"a \"b\"","it's":"it's","empty":null,"none":null,"flags":[true,false],)"
      R"("numbers":[1,-2.5,300.0,0.5],"deep":[[1,[2,3]],{"x":1,"y":0,"z":["a b","c"]}],)"
      R"("objects":[{"id":"Can1","primitives":[{"type":"cylinder","dimensions":[0.14,0.03]}],)"
      R"("pose":{"position":{"x":1,"y":2,"z":3}}},{"id":"007 apples"},[1,2]],)"
      R"("url":"package://a/b.stl#c","time":"12:30","last":"0x10"})");
  EXPECT_TRUE(parse("").is_null());
  EXPECT_TRUE(parse("# nothing\n").is_null());
  EXPECT_EQ(parse("\xEF\xBB\xBF"
                  "a: 1\r\nb: 2\r\n")
                .dump(),
            R"({"a":1,"b":2})");
  EXPECT_EQ(parse("a: 1\n---\n").dump(), R"({"a":1})");
  EXPECT_EQ(parse("a: b\n  c\nd: 'e\n  f'\ng: |\n  h\n  i\n").dump(),
            R"({"a":"b c","d":"e f","g":"h\ni\n"})");
  EXPECT_EQ(parse(R"(a: "\x41\u00e9")").dump(), R"({"a":"Aé"})");
  EXPECT_EQ(parse(".nan"), ".nan");
  EXPECT_EQ(parse("[inf, -.inf, nan]").dump(), R"(["inf","-.inf","nan"])");
}

TEST(YamlReader, RefusesWhatItDoesNotRead) {
  EXPECT_EQ(message_of("a: 1\na: 2\n"), "f.yaml:2:1: the key 'a' occurs twice in one mapping");
  EXPECT_NE(message_of("a: {b: 1, b: 2}").find("f.yaml:1:11: the key 'b'"), std::string::npos);
  EXPECT_NE(message_of("a: &x 1").find("f.yaml:1:4: anchors"), std::string::npos);
  EXPECT_NE(message_of("a: *x").find("anchors"), std::string::npos);
  EXPECT_NE(message_of("a: !!str 1").find("tags"), std::string::npos);
  EXPECT_NE(message_of("a: 1\n---\nb: 2\n").find("f.yaml:2:1: expected one document"),
            std::string::npos);
  EXPECT_NE(message_of("a: 1\n---\n---\n").find("expected one document"), std::string::npos);
  EXPECT_NE(message_of("a:\n\tb: 1\n").find("tab"), std::string::npos);
  EXPECT_EQ(message_of("a: [1, 2\n"), "f.yaml:2:1: end of sequence flow not found");
  EXPECT_EQ(message_of("a: [1, 2] 3\n"), "f.yaml:1:11: end of map not found");
  EXPECT_NE(message_of("a: \"b\n").find("f.yaml:2:1: expected the closing quotation mark"),
            std::string::npos);
  EXPECT_NE(message_of("a: 'b").find("closing quotation mark"), std::string::npos);
  EXPECT_EQ(message_of("a: b: c\n"), "f.yaml:1:5: illegal map value");
  EXPECT_NE(message_of("a: 1\n- b\n").find("f.yaml:2:1"), std::string::npos);
  EXPECT_EQ(message_of(", x"), "f.yaml:1:1: unexpected ',' outside of any value");
  EXPECT_NE(message_of("? [1]\n: 2").find("f.yaml:1:3: expected text as a key"), std::string::npos);
  EXPECT_NE(message_of("~: 2").find("expected text as a key, found nothing"), std::string::npos);
  // Which the parser takes for the end of the file.
  EXPECT_EQ(message_of("a: 1\nb\x04: 2"), "f.yaml:2:2: expected text, found a byte 4");
  EXPECT_NE(message_of(std::string("a: 1\0", 5)).find("found a byte 0"), std::string::npos);
  EXPECT_NE(message_of(std::string(100'000, '[')).find("f.yaml:1:1"), std::string::npos);
  EXPECT_NE(message_of(std::string(1000, '[') + std::string(1000, ']')).find("too deeply"),
            std::string::npos);
  std::string dashes;
  for (int k = 0; k < 20'000; ++k) dashes += "- ";
  EXPECT_NE(message_of(dashes + "1").find("nested too deeply"), std::string::npos);
}

Json random_value(std::mt19937_64& random, int depth) {
  const auto pick = [&random](int count) { return int(random() % std::uint64_t(count)); };
  static constexpr const char* kWords[] = {"",  "a",    "b c", "- x", "#no", "a: b", "it's",
                                           "1", "true", "~",   "[x",  "x]",  "\\",   "\"q\""};
  switch (depth > 4 ? pick(5) : pick(9)) {
    case 0:
      return {};
    case 1:
      return pick(2) == 0;
    case 2:
      return std::int64_t(random()) >> pick(64);
    case 3:
      return std::ldexp(Scalar(std::int64_t(random())), pick(100) - 100);
    case 4:
      return kWords[pick(14)];
    case 5:
    case 6: {
      Json list = Json::array();
      for (int k = pick(4); k > 0; --k) list.push_back(random_value(random, depth + 1));
      return list;
    }
    default: {
      Json object = Json::object();
      for (int k = pick(4); k > 0; --k) {
        object[std::string(kWords[pick(14)]) + std::to_string(k)] = random_value(random, depth + 1);
      }
      return object;
    }
  }
}

// Written in blocks down to a random depth, and as JSON, which is YAML too, below it.
std::string written(const Json& value, std::size_t indent, std::mt19937_64& random) {
  const std::string margin(indent, ' ');
  if (!value.is_structured() || value.empty() || random() % 4 == 0)
    return " " + value.dump() + "\n";
  std::string text = "\n";
  if (value.is_array()) {
    for (const Json& item : value) text += margin + "-" + written(item, indent + 2, random);
  } else {
    for (const auto& [key, item] : value.items()) {
      if (random() % 8 == 0) text += margin + "# a remark: [\n\n";
      text += margin + Json(key).dump() + ":" + written(item, indent + 1 + random() % 3, random);
    }
  }
  return text;
}

TEST(YamlReader, ReadsRandomTreesBack) {
  std::mt19937_64 random(1);
  for (int k = 0; k < 2000; ++k) {
    const Json value = random_value(random, 0);
    const std::string text = written(value, 0, random);
    EXPECT_EQ(parse(text), value) << text;
    EXPECT_EQ(parse(value.dump(2)), value);
  }
}

// Neither crashes nor anything but a FileError.
TEST(YamlReader, SurvivesDamage) {
  std::mt19937_64 random(2);
  constexpr std::string_view kSigns = "\n \t:-#[]{},\"'\\&*!|>?%@0a";
  for (int k = 0; k < 20'000; ++k) {
    std::string text = written(random_value(random, 0), 0, random);
    for (int change = 0; change < 3; ++change) {
      if (text.empty()) break;
      text[random() % text.size()] = kSigns[random() % kSigns.size()];
    }
    text.resize(random() % (text.size() + 1));
    try {
      parse(text);
    } catch (const FileError& error) {
      EXPECT_TRUE(error.position());
    }
  }
}

}  // namespace
}  // namespace dyop::io_internal
