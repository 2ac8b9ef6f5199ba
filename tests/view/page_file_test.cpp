// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <array>
#include <regex>

#include "dyop/core/error.h"
#include "dyop/view/run_files.h"

namespace dyop {
namespace {

TEST(PageFile, HoldsEscapedTitleAndBlocksAndNoAddressOfANetwork) {
  const std::array<std::string, 4> blocks{"", "f", "fo", "foobar"};
  if (!has_page()) {
    EXPECT_THROW(page_html("x", blocks), InvalidArgument);
    GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  }
  const std::string page = page_html("</title><b>", blocks);
  EXPECT_NE(page.find("&lt;/title&gt;&lt;b&gt;"), std::string::npos);
  EXPECT_EQ(page.find("</title><b>"), std::string::npos);
  for (const char* text : {">Zg==<", ">Zm8=<", ">Zm9vYmFy<"}) {  // RFC 4648, section 10
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  const std::regex reference("(src|href)=[\"']?(https?:)?//");
  EXPECT_FALSE(std::regex_search(page, reference));
}

TEST(PageFile, OfALiveRunHoldsNoBlocks) {
  if (!has_page()) {
    EXPECT_THROW(live_page_html("x"), InvalidArgument);
    GTEST_SKIP() << "runs where the page is built: bash .ci/install.sh page";
  }
  EXPECT_NE(live_page_html("x").find("id=\"live\""), std::string::npos);
  EXPECT_EQ(live_page_html("x").find("class=\"block\""), std::string::npos);
}

}  // namespace
}  // namespace dyop
