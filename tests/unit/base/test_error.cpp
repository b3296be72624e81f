#include <gtest/gtest.h>

#include "crackle/base/error.hpp"

namespace crackle {
namespace {

TEST(Error, ShowsATextOnOneLine) {
  EXPECT_EQ(one_line("plain"), "plain");
  EXPECT_EQ(one_line("Poisson's \xc3\xa9t\xc3\xa9 \xe2\x82\xac \xf0\x9f\x94\xa8"),
            "Poisson's \xc3\xa9t\xc3\xa9 \xe2\x82\xac \xf0\x9f\x94\xa8");
  EXPECT_EQ(one_line("a\nb\tc\x1b[31m\x7f"), "a\\nb\\tc\\x1b[31m\\x7f");
  EXPECT_EQ(one_line("\xff\xc3(\xc0\x80\xc2\x85"), "\\xff\\xc3(\\xc0\\x80\\xc2\\x85")
      << "no UTF-8, or control";
  EXPECT_EQ(one_line("\xe2\x82"), "\\xe2\\x82") << "ends too early";
  EXPECT_EQ(one_line(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(one_line(std::string(300, 'x'), 200), std::string(200, 'x') + "... (300 bytes)");
  EXPECT_EQ(one_line(std::string(200, 'x'), 200), std::string(200, 'x'));
}

TEST(Error, ShortensValuesAndKeepsWhatIsAllowed) {
  const std::string what = InputError("-model", std::string(5000, 'a'), "spring or fuse").what();
  EXPECT_EQ(what, "-model " + std::string(kShownValue, 'a') + "... (5000 bytes): allowed is spring or fuse");
}

}  // namespace
}  // namespace crackle
