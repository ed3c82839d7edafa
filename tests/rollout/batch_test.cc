#include "rollout/batch.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

/// Sample b of every array of numbers holds one that only it has.
Batch Numbered(Index B) {
  Batch batch;
  batch.Resize(2, 1, B);
  batch.P_old.resize(3, B);
  batch.stop.resize(std::size_t(B));
  for (Index b = 0; b < B; ++b) {
    const Real x = Real(20 * b);
    const std::size_t i = std::size_t(b);
    batch.s.col(b) << x, x + 1;
    batch.a(0, b) = x + 2;
    batch.o[i] = int(b);
    batch.o_prev[i] = int(b + 1);
    batch.init[i] = b % 2 == 0;
    batch.option.logp_old(b) = x + 3;
    batch.option.adv_hat(b) = x + 4;
    batch.option.ret(b) = x + 5;
    batch.action.logp_old(b) = x + 6;
    batch.action.adv_hat(b) = x + 7;
    batch.action.ret(b) = x + 8;
    batch.P_old.col(b) << x + 9, x + 10, x + 11;
    batch.stop[i] = b % 3 == 1;
  }
  return batch;
}

TEST(Gather, CopiesEveryArrayOfTheSamples) {
  const Batch all = Numbered(5);
  Batch out;
  const std::vector<int> rows = {1, 4, 0};  // in place the flags would be others
  Gather(all, rows, out);
  ASSERT_EQ(out.Size(), 3);
  for (Index to = 0; to < 3; ++to) {
    const Index b = rows[std::size_t(to)];
    const Real x = Real(20 * b);
    const std::size_t i = std::size_t(to);
    EXPECT_EQ(out.s(0, to), x);
    EXPECT_EQ(out.s(1, to), x + 1);
    EXPECT_EQ(out.a(0, to), x + 2);
    EXPECT_EQ(out.o[i], int(b));
    EXPECT_EQ(out.o_prev[i], int(b + 1));
    EXPECT_EQ(out.init[i], b % 2 == 0);
    EXPECT_EQ(out.option.logp_old(to), x + 3);
    EXPECT_EQ(out.option.adv_hat(to), x + 4);
    EXPECT_EQ(out.option.ret(to), x + 5);
    EXPECT_EQ(out.action.logp_old(to), x + 6);
    EXPECT_EQ(out.action.adv_hat(to), x + 7);
    EXPECT_EQ(out.action.ret(to), x + 8);
    for (Index k = 0; k < 3; ++k) EXPECT_EQ(out.P_old(k, to), x + 9 + Real(k));
    EXPECT_EQ(out.stop[i], b % 3 == 1);
  }
}

TEST(Gather, LeavesOutWhatTheMethodDoesNotKeep) {
  Batch all = Numbered(5), out;
  all.P_old.resize(0, 0);
  all.stop.clear();
  Gather(all, std::vector<int>{4, 1}, out);
  EXPECT_EQ(out.P_old.size(), 0);
  EXPECT_TRUE(out.stop.empty());
}

TEST(Gather, ResizesOnlyWhenTheSizeChanges) {
  const Batch all = Numbered(5);
  Batch out;
  Gather(all, std::vector<int>{0, 1}, out);
  const Real* before = out.s.data();
  Gather(all, std::vector<int>{3, 2}, out);
  EXPECT_EQ(out.s.data(), before);
  Gather(all, std::vector<int>{3}, out);
  EXPECT_EQ(out.Size(), 1);
}

}  // namespace
}  // namespace o2v
