// Worked examples of the small layers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

#include "base/check.h"
#include "nn/dropout.h"
#include "nn/embedding.h"
#include "nn/layer_norm.h"
#include "nn/linear.h"
#include "random_mat.h"

namespace o2v {
namespace {

TEST(Linear, MapsAndAddsItsBias) {
  Linear f("f", 2, 2);
  f.W.value << 1, 2, 3, 4;
  f.b.value << 10, 20;
  Mat x(2, 2), y(2, 2), expected(2, 2);
  x << 1, 0, 1, -1;
  f.Forward(x, y);
  expected << 13, 8, 27, 16;
  EXPECT_EQ(y, expected);
}

TEST(Linear, BackwardAddsToTheGradients) {
  Linear f("f", 1, 1);
  const Mat x = Mat::Constant(1, 2, 3), dy = Mat::Constant(1, 2, 5);
  f.AddGrad(x, dy);
  f.AddGrad(x, dy);
  EXPECT_EQ(f.W.grad(0), 60);  // 2 passes of 2 samples of 3 * 5
  EXPECT_EQ(f.b.grad(0), 20);
}

TEST(Linear, RefusesInputsOfAnotherSize) {
  const Linear f("f", 3, 2);
  Mat y(2, 1);
  EXPECT_THROW(f.Forward(Mat::Zero(4, 1), y), Error);
}

TEST(LayerNorm, UsesThePopulationVariance) {
  LayerNorm norm("norm", 2);
  norm.gain.value << 2, 3;
  norm.shift.value << 10, 20;
  LayerNorm::Cache cache;
  Mat x(2, 1), y(2, 1);
  x << 1, 5;  // mean 3, variance 4
  norm.Forward(x, cache, y);
  const double x_hat = 2 / std::sqrt(4 + 1e-5);
  EXPECT_NEAR(y(0), 10 - 2 * x_hat, 1e-5);
  EXPECT_NEAR(y(1), 20 + 3 * x_hat, 1e-5);
}

TEST(LayerNorm, OfAConstantColumnIsItsShift) {
  const LayerNorm norm("norm", 3);
  LayerNorm::Cache cache;
  Mat y(3, 1);
  norm.Forward(Mat::Constant(3, 1, 7), cache, y);
  EXPECT_TRUE(y.isZero());
}

TEST(LayerNorm, EqualsTheTextbookAtEveryLength) {
  Rng rng(3, "test");
  for (Index n = 1; n <= 50; ++n) {
    LayerNorm norm("norm", n);
    norm.gain.value = RandomMat(n, 1, rng);
    norm.shift.value = RandomMat(n, 1, rng);
    LayerNorm::Cache cache;
    const Mat x = RandomMat(n, 2, rng);
    Mat y(n, 2);
    norm.Forward(x, cache, y);
    for (Index b = 0; b < 2; ++b) {
      const VecD centred = x.col(b).cast<double>().array() - x.col(b).cast<double>().mean();
      const double std = std::sqrt(centred.array().square().mean() + 1e-5);
      for (Index i = 0; i < n; ++i) {
        EXPECT_NEAR(y(i, b), norm.gain.value(i) * centred(i) / std + norm.shift.value(i), 1e-5)
            << "entry " << i << " of " << n;
      }
    }
  }
}

TEST(LayerNorm, MayWorkInPlace) {
  constexpr Index kN = 29;
  Rng rng(1, "test");
  LayerNorm norm("norm", kN);
  norm.gain.value = RandomMat(kN, 1, rng);
  LayerNorm::Cache cache;
  const Mat x = RandomMat(kN, 3, rng), dy = RandomMat(kN, 3, rng);
  Mat y(kN, 3), dx(kN, 3), x_in_place = x, dy_in_place = dy;
  norm.Forward(x, cache, y);
  norm.Backward(cache, dy, dx);
  norm.Forward(x_in_place, cache, x_in_place);
  norm.Backward(cache, dy_in_place, dy_in_place);
  EXPECT_EQ(x_in_place, y);
  EXPECT_EQ(dy_in_place, dx);
}

TEST(LayerNorm, RefusesShapesThatDoNotFit) {
  LayerNorm norm("norm", 4);
  LayerNorm::Cache cache;
  Mat y(4, 2), dx(4, 2);
  EXPECT_THROW(norm.Forward(Mat::Zero(5, 2), cache, y), Error);
  EXPECT_THROW(norm.Forward(Mat::Zero(4, 3), cache, y), Error);
  norm.Forward(Mat::Zero(4, 2), cache, y);
  EXPECT_THROW(norm.Backward(cache, Mat::Zero(4, 3), dx), Error);
  EXPECT_THROW(norm.Backward(cache, Mat::Zero(4, 1), dx), Error);
}

TEST(Dropout, DropsAtItsRateAndScalesTheRest) {
  Rng rng(2, "test");
  for (const double p : {0.2, 0.5}) {
    Mat mask(101, 99);  // not a multiple of the four entries that a word gives
    DrawDropoutMask(p, rng, mask);
    const double n = double(mask.size());
    const double dropped = double((mask.array() == 0).count());
    EXPECT_EQ(dropped + double((mask.array() == Real(1 / (1 - p))).count()), n);
    EXPECT_NEAR(dropped / n, p, 5 * std::sqrt(p * (1 - p) / n));
  }
}

TEST(Dropout, DropsWhereSixteenBitsAreBelowTheProbability) {
  // 0.2 * 2^16 = 13107.2, so below 0x3333: a byte of 0x33 is decided by the low byte of the next
  // word, after the words of its block of 512 entries; 0.5 is 0x8000, where the second byte never
  // drops.
  for (const auto& [p, first, second] : {std::tuple(0.2, 0x33, 0x33), std::tuple(0.5, 0x80, 0)}) {
    Rng rng(6, "test"), again(6, "test");
    Mat mask(37, 41);  // 1517 = 512 + 512 + 493 entries
    DrawDropoutMask(p, rng, mask);
    int decided_late = 0;
    for (Index start = 0; start < mask.size(); start += 512) {
      const Index n = std::min<Index>(512, mask.size() - start);
      std::vector<std::uint64_t> words(static_cast<std::size_t>((n + 7) / 8));
      for (std::uint64_t& word : words) word = again.Bits();
      for (Index k = 0; k < n; ++k) {
        const int byte = int(words[std::size_t(k / 8)] >> (8 * (k % 8)) & 0xff);
        bool dropped = byte < first;
        if (byte == first) {
          dropped = int(again.Bits() & 0xff) < second;
          ++decided_late;
        }
        ASSERT_EQ(mask.data()[start + k], dropped ? Real(0) : Real(1 / (1 - p))) << start + k;
      }
    }
    EXPECT_GT(decided_late, 0);
    EXPECT_EQ(rng.Bits(), again.Bits()) << "bits drawn";
  }
}

TEST(Dropout, DropsEverythingNearOne) {
  Rng rng(9, "mask");
  Mat mask(8, 8);
  for (const double p : {1 - 0x1p-18, 1 - 0x1p-40}) {
    DrawDropoutMask(p, rng, mask);
    EXPECT_TRUE((mask.array() == 0).all()) << p;
  }
}

TEST(Dropout, EntriesOfAWordAreIndependent) {
  Rng rng(3, "test");
  Mat mask(4, 5000);
  DrawDropoutMask(0.5, rng, mask);
  const Mat kept = mask.array() / 2 - Real(0.5);  // +-1/2
  for (Index i = 0; i < 4; ++i) {
    for (Index j = 0; j < i; ++j) {
      EXPECT_LT(std::abs(4 * kept.row(i).dot(kept.row(j)) / 5000), 5 / std::sqrt(5000.0));
    }
  }
}

TEST(Dropout, WithProbabilityZeroKeepsEverything) {
  Rng rng(4, "test");
  Mat mask(5, 5);
  DrawDropoutMask(0, rng, mask);
  EXPECT_EQ(mask, Mat::Ones(5, 5));
}

TEST(Dropout, RefusesProbabilityOne) {
  Rng rng(5, "test");
  Mat mask(1, 1);
  EXPECT_THROW(DrawDropoutMask(1, rng, mask), Error);
}

TEST(Embedding, GathersAndScattersColumns) {
  Mat E(1, 3), out(1, 4), dE = Mat::Zero(1, 3), d(1, 4), gathered(1, 4), scattered(1, 3);
  E << 10, 20, 30;
  d << 1, 2, 4, 8;
  const std::vector<int> o = {2, 0, 2, 2};
  GatherColumns(E, o, out);
  ScatterColumns(d, o, dE);
  gathered << 30, 10, 30, 30;
  scattered << 2, 0, 13;
  EXPECT_EQ(out, gathered);
  EXPECT_EQ(dE, scattered);
}

TEST(EmbeddedLinear, EqualsALinearMapOfStateAndEmbedding) {
  Rng rng(6, "test");
  EmbeddedLinear f("f", 4, 3, 5);
  Linear whole("f", 7, 5);
  f.W.value = whole.W.value = RandomMat(5, 7, rng);
  f.b.value = whole.b.value = RandomMat(5, 1, rng);
  const Mat E = RandomMat(3, 4, rng), s = RandomMat(4, 6, rng);
  const std::vector<int> o = RandomOptions(6, 4, rng);
  Mat o_hat(3, 6), x(7, 6), expected(5, 6), y(5, 6), table;
  GatherColumns(E, o, o_hat);
  x << s, o_hat;
  whole.Forward(x, expected);
  f.MakeTable(E, table);
  f.MultiplyState(s, y);
  for (std::size_t b = 0; b < o.size(); ++b) y.col(Index(b)) += table.col(o[b]);
  EXPECT_LT((y - expected).cwiseAbs().maxCoeff(), 1e-5);
}

}  // namespace
}  // namespace o2v
