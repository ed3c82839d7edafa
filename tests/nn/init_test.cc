#include "nn/init.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nn/attention_block.h"
#include "nn/mlp.h"

namespace o2v {
namespace {

/// Largest entry of |x - y|.
double Distance(const Mat& x, const Mat& y) { return double((x - y).cwiseAbs().maxCoeff()); }

TEST(Orthogonal, RowsAreOrthonormalWhereThereAreFewer) {
  Rng rng(1, "test");
  Mat W(3, 7);
  Orthogonal(W, 1, rng);
  EXPECT_LT(Distance(W * W.transpose(), Mat::Identity(3, 3)), 1e-6);
}

TEST(Orthogonal, ColumnsAreOrthonormalWhereThereAreFewer) {
  Rng rng(2, "test");
  Mat W(7, 3);
  Orthogonal(W, 1, rng);
  EXPECT_LT(Distance(W.transpose() * W, Mat::Identity(3, 3)), 1e-6);
}

TEST(Orthogonal, GainScalesTheMatrix) {
  Rng rng(3, "test");
  Mat W(4, 4);
  Orthogonal(W, 1e-3, rng);
  EXPECT_LT(Distance(W * W.transpose(), 1e-6 * Mat::Identity(4, 4)), 1e-12);
}

TEST(Orthogonal, HasNoPreferredSign) {
  // With the signs of R's diagonal fixed Q is uniform, so each diagonal entry is positive half the
  // time; Householder's own Q is not.
  Rng rng(4, "test");
  constexpr int n = 400;
  int positive[2] = {0, 0};
  for (int i = 0; i < n; ++i) {
    Mat W(2, 2);
    Orthogonal(W, 1, rng);
    for (Index k = 0; k < 2; ++k) positive[k] += W(k, k) > 0;
  }
  for (const int count : positive) EXPECT_NEAR(count, n / 2.0, 5 * std::sqrt(n / 4.0));
}

TEST(XavierUniform, FillsItsInterval) {
  Rng rng(5, "test");
  Mat W(30, 20);
  XavierUniform(W, rng);
  const double a = std::sqrt(6.0 / 50);
  EXPECT_LE(W.maxCoeff(), a);
  EXPECT_GT(W.maxCoeff(), 0.95 * a);
  EXPECT_GE(W.minCoeff(), -a);
  EXPECT_LT(W.minCoeff(), -0.95 * a);
  EXPECT_NEAR(W.mean(), 0, 5 * a / std::sqrt(3.0 * 600));  // five standard errors
}

TEST(Initialiser, DrawsFromItsStreamAndWithoutOneNothing) {
  Rng a(8, "test"), b(8, "test");
  Mat drawn(4, 3), expected(4, 3), blank = Mat::Zero(4, 3);
  Initialiser(a).Orthogonal(drawn, 2);
  Orthogonal(expected, 2, b);
  EXPECT_EQ(drawn, expected);
  Initialiser(a).XavierUniform(drawn);
  XavierUniform(expected, b);
  EXPECT_EQ(drawn, expected);
  EXPECT_EQ(a.Bits(), b.Bits());
  Initialiser().Orthogonal(blank, 2);
  Initialiser().XavierUniform(blank);
  EXPECT_TRUE(blank.isZero(0));
}

TEST(MlpTrunk, StartsOrthogonalWithZeroBiases) {
  Rng rng(6, "test");
  MlpTrunk body("net", 5, 8, Activation::kTanh, rng);
  const Mat& W = body.layer0.W.value;
  EXPECT_LT(Distance(W.transpose() * W, Mat::Identity(5, 5)), 1e-6);
  EXPECT_TRUE(body.layer0.b.value.isZero());
  EXPECT_TRUE(body.layer1.b.value.isZero());
  EXPECT_EQ(body.Params()[2]->name, "net.1.W");
}

TEST(AttentionBlock, StartsWithTheBoundsOfTheSpec) {
  Rng rng(7, "test");
  constexpr Index D = 12, F = 20;
  AttentionBlock block("attention", "block", D, 1, F);
  block.Init(rng);
  const auto largest = [](const Param& p) { return double(p.value.cwiseAbs().maxCoeff()); };
  // Spec 2.6 item 5: the in-projection's fans are those of the whole (3D, D) block.
  const double in = std::sqrt(6.0 / (4 * D)), out = std::sqrt(6.0 / (2 * D));
  for (const Param* p : {&block.attention.Wq, &block.attention.Wk, &block.attention.Wv}) {
    EXPECT_LE(largest(*p), in) << p->name;
    EXPECT_GT(largest(*p), 0.9 * in) << p->name;
  }
  EXPECT_LE(largest(block.attention.W_out), out);
  EXPECT_GT(largest(block.attention.W_out), 0.9 * out);
  EXPECT_EQ(largest(block.attention.bq), 0);
  EXPECT_LE(largest(block.ffn0.b), 1 / std::sqrt(double(D)));
  EXPECT_GT(largest(block.ffn0.b), 0);
  EXPECT_LE(largest(block.ffn1.b), 1 / std::sqrt(double(F)));
  EXPECT_GT(largest(block.ffn1.b), 0);
}

TEST(AttentionBlock, HasTheParametersOfTheSpec) {
  // Spec 2.6 item 5: 4 D^2 + 4 D + 2 D F + F + D + 6 D at D = 40, F = 50.
  AttentionBlock block("attention", "block", 40, 1, 50);
  EXPECT_EQ(CountParams(block.Params()), 10890);
}

}  // namespace
}  // namespace o2v
