#include "rollout/minibatch.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

namespace o2v {
namespace {

std::vector<std::vector<int>> Epoch(std::size_t n, int size, Rng& rng) {
  std::vector<int> order(n);
  std::vector<std::vector<int>> blocks;
  ForEachMinibatch(order, size, rng, [&](std::span<const int> rows) {
    blocks.emplace_back(rows.begin(), rows.end());
  });
  return blocks;
}

TEST(Minibatches, CoverEveryIndexOnceTheRemainderIncluded) {
  Rng rng(1, "test");
  const auto blocks = Epoch(10, 4, rng);
  ASSERT_EQ(blocks.size(), 3u);
  EXPECT_EQ(blocks[0].size(), 4u);
  EXPECT_EQ(blocks[1].size(), 4u);
  EXPECT_EQ(blocks[2].size(), 2u);
  std::array<int, 10> seen{};
  for (const auto& block : blocks) {
    for (const int row : block) ++seen.at(std::size_t(row));
  }
  for (const int times : seen) EXPECT_EQ(times, 1);
}

TEST(Minibatches, HaveNoRemainderWhereTheSizeDivides) {
  Rng rng(2, "test");
  EXPECT_EQ(Epoch(12, 4, rng).size(), 3u);
}

TEST(Minibatches, AreOneWhereTheyWouldHoldMoreThanThereIs) {
  Rng rng(3, "test");
  const auto blocks = Epoch(3, 64, rng);
  ASSERT_EQ(blocks.size(), 1u);
  EXPECT_EQ(blocks[0].size(), 3u);
}

TEST(Minibatches, AreShuffledAnewEachEpoch) {
  Rng rng(4, "test");
  EXPECT_NE(Epoch(50, 50, rng), Epoch(50, 50, rng));
}

TEST(Minibatches, PutEveryIndexAtEveryPlaceEquallyOften) {
  Rng rng(5, "test");
  constexpr int n = 4, epochs = 4000;
  int counts[n][n] = {};
  for (int e = 0; e < epochs; ++e) {
    const auto block = Epoch(n, n, rng)[0];
    for (std::size_t place = 0; place < n; ++place) ++counts[place][block[place]];
  }
  for (const auto& place : counts) {
    for (const int count : place) {
      EXPECT_NEAR(count, epochs / n, 5 * std::sqrt(epochs * 0.25 * 0.75));
    }
  }
}

}  // namespace
}  // namespace o2v
