#include "base/settings.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

std::string MessageOf(const std::function<void()>& act) {
  try {
    act();
  } catch (const ConfigError& e) {
    return e.what();
  }
  return "nothing was thrown";
}

TEST(Settings, ReturnsWhatWasSetLast) {
  Settings s;
  s.Set("gamma", 0.9, "a.toml:1");
  s.Set("gamma", 0.99, "--set");
  EXPECT_EQ(s.Real("gamma"), 0.99);
  EXPECT_EQ(s.Origin("gamma"), "--set");
}

TEST(Settings, NamesAMissingKey) {
  const Settings s;
  EXPECT_NE(MessageOf([&] { s.Real("lambda"); }).find("'lambda'"), std::string::npos);
}

TEST(Settings, RefusesAFractionWhereAWholeNumberIsNeeded) {
  Settings s;
  s.Set("epochs", 2.5, "a.toml:7");
  const std::string message = MessageOf([&] { s.Int("epochs"); });
  EXPECT_NE(message.find("a.toml:7"), std::string::npos) << message;
  EXPECT_NE(message.find("'epochs'"), std::string::npos) << message;
}

TEST(Settings, RefusesWholeNumbersOutOfRange) {
  Settings s;
  s.Set("small", 0, "a.toml:1");
  s.Set("large", 2147483648.0, "a.toml:2");  // 2^31
  s.Set("nan", std::numeric_limits<double>::quiet_NaN(), "a.toml:3");
  EXPECT_EQ(s.Int("small", 0), 0);
  EXPECT_THROW(s.Int("small", 1), ConfigError);
  EXPECT_THROW(s.Int("large"), ConfigError);
  EXPECT_THROW(s.Int("nan"), ConfigError);
}

TEST(Settings, ListsKeysThatNobodyRead) {
  Settings s;
  s.Set("a", 1, "");
  s.Set("b", 2, "");
  s.Set("c", 3, "");
  s.Int("b");
  EXPECT_EQ(s.Unused(), (std::vector<std::string>{"a", "c"}));
}

TEST(Settings, AskingWhetherAKeyExistsDoesNotUseIt) {
  Settings s;
  s.Set("a", 1, "");
  EXPECT_TRUE(s.Has("a"));
  EXPECT_FALSE(s.Has("b"));
  EXPECT_EQ(s.Unused(), std::vector<std::string>{"a"});
}

TEST(Settings, ItemsAreSortedByKey) {
  Settings s;
  s.Set("b", 2, "");
  s.Set("a", 1, "");
  const std::vector<std::pair<std::string, double>> expected = {{"a", 1}, {"b", 2}};
  EXPECT_EQ(s.Items(), expected);
}

}  // namespace
}  // namespace o2v
