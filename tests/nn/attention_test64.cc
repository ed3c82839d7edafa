// The rearranged attention against the textbook's, in double.

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "base/check.h"
#include "nn/attention_block.h"
#include "nn/dropout.h"
#include "random_mat.h"

namespace o2v {
namespace {

constexpr Index D = 6, K = 4, F = 7, B = 5;

/// Spec 3.6 and Vaswani et al. 2017, one query and one head at a time.
Mat TextbookAttention(const MemoryAttention& f, const Mat& E, const Mat& x, const Mat* mask) {
  const Index d = D / f.heads;
  Mat y(D, x.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    const Vec q = f.Wq.value * x.col(n) + f.bq.value;
    Vec c(D);
    for (Index h = 0; h < f.heads; ++h) {
      Vec score(K);
      Mat v(d, K);
      for (Index j = 0; j < K; ++j) {
        const Vec key = f.Wk.value * E.col(j) + f.bk.value;
        const Vec value = f.Wv.value * E.col(j) + f.bv.value;
        score(j) = q.segment(h * d, d).dot(key.segment(h * d, d)) / std::sqrt(double(d));
        v.col(j) = value.segment(h * d, d);
      }
      Vec alpha = score.array().exp();
      alpha /= alpha.sum();
      if (mask) alpha.array() *= mask->col(n).segment(h * K, K).array();
      c.segment(h * d, d) = v * alpha;
    }
    y.col(n) = f.W_out.value * c + f.b_out.value;
  }
  return y;
}

Mat TextbookNorm(const LayerNorm& f, const Mat& x) {
  Mat y(x.rows(), x.cols());
  for (Index n = 0; n < x.cols(); ++n) {
    const Vec centred = x.col(n).array() - x.col(n).mean();
    const double std = std::sqrt(centred.array().square().mean() + 1e-5);
    y.col(n) = f.gain.value.array() * centred.array() / std + f.shift.value.array();
  }
  return y;
}

void Randomize(const std::vector<Param*>& params, Rng& rng) {
  for (Param* p : params) p->value = RandomMat(p->value.rows(), p->value.cols(), rng, 0.7);
}

TEST(MemoryAttention, EqualsTheTextbook) {
  Rng rng(1, "test");
  for (const Index heads : {1, 2, 3, 6}) {
    MemoryAttention f("attention", D, heads);
    Randomize(f.Params(), rng);
    const Mat E = RandomMat(D, K, rng), x = RandomMat(D, B, rng);
    Mat kept(heads * K, B), y(D, B);
    DrawDropoutMask(0.2, rng, kept);
    MemoryAttention::Memory memory;
    MemoryAttention::Cache cache;
    f.Project(E, memory);
    for (const Mat* mask : {static_cast<const Mat*>(nullptr), static_cast<const Mat*>(&kept)}) {
      f.Forward(x, memory, mask, cache, y);
      const double difference = (y - TextbookAttention(f, E, x, mask)).cwiseAbs().maxCoeff();
      EXPECT_LT(difference, 1e-12) << heads << " heads, mask " << (mask != nullptr);
    }
  }
}

TEST(MemoryAttention, WeightsOfEachHeadSumToOne) {
  Rng rng(2, "test");
  MemoryAttention f("attention", D, 2);
  Randomize(f.Params(), rng);
  MemoryAttention::Memory memory;
  MemoryAttention::Cache cache;
  Mat y(D, B);
  f.Project(100 * RandomMat(D, K, rng), memory);  // scores that overflow exp
  f.Forward(100 * RandomMat(D, B, rng), memory, nullptr, cache, y);
  EXPECT_TRUE(cache.alpha.allFinite());
  EXPECT_GE(cache.alpha.minCoeff(), 0);
  for (Index h = 0; h < 2; ++h) {
    const Vec sums = cache.alpha.middleRows(h * K, K).colwise().sum().transpose();
    EXPECT_LT((sums.array() - 1).abs().maxCoeff(), 1e-12);
  }
}

TEST(MemoryAttention, RefusesHeadsThatDoNotDivideItsWidth) {
  EXPECT_THROW(MemoryAttention("attention", D, 4), Error);
}

TEST(AttentionBlock, EqualsTheTextbook) {
  Rng rng(3, "test");
  AttentionBlock f("attention", "block", D, 2, F);
  Randomize(f.Params(), rng);
  const Mat E = RandomMat(D, K, rng), x = RandomMat(D, B, rng);
  AttentionBlock::Masks m;
  m.Resize(2 * K, D, F, B);
  m.Draw(0.2, rng);
  AttentionBlock::Cache cache;
  MemoryAttention::Memory memory;
  f.attention.Project(E, memory);
  f.Forward(x, memory, &m, cache);

  // Spec 2.6 item 5.
  const Mat attended = TextbookAttention(f.attention, E, x, &m.attention);
  const Mat y = TextbookNorm(f.ln2, x + attended.cwiseProduct(m.after_attention));
  const Mat z = (f.ffn0.W.value * y).colwise() + f.ffn0.b.value.col(0);
  const Mat hidden = z.cwiseMax(0).cwiseProduct(m.inside_ffn);
  const Mat fed = (f.ffn1.W.value * hidden).colwise() + f.ffn1.b.value.col(0);
  const Mat t = TextbookNorm(f.ln_final, TextbookNorm(f.ln3, y + fed.cwiseProduct(m.after_ffn)));
  EXPECT_LT((cache.out - t).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(AttentionBlock, OfNoSamplesAddsNothingToTheGradients) {
  Rng rng(5, "test");
  AttentionBlock f("attention", "block", D, 2, F);
  Randomize(f.Params(), rng);
  for (Param* p : f.Params()) p->grad.setConstant(3);
  const Mat E = RandomMat(D, K, rng), x(D, 0);
  Mat dE = Mat::Constant(D, K, 5), dout(D, 0), dx(D, 0);
  AttentionBlock::Masks m;
  m.Resize(2 * K, D, F, 0);
  m.Draw(0.2, rng);
  MemoryAttention::Memory memory;
  f.attention.Project(E, memory);
  for (const AttentionBlock::Masks* masks : {&std::as_const(m), {}}) {
    AttentionBlock::Cache cache;
    f.Forward(x, memory, masks, cache);
    EXPECT_EQ(cache.out.rows(), D);
    EXPECT_EQ(cache.out.cols(), 0);
    f.Backward(x, E, memory, masks, cache, dout, dx, dE);
  }
  for (const Param* p : f.Params()) EXPECT_TRUE((p->grad.array() == 3).all()) << p->name;
  EXPECT_EQ(dE, Mat::Constant(D, K, 5));
}

TEST(AttentionBlock, MasksOfOnesChangeNothing) {
  Rng rng(4, "test");
  AttentionBlock f("attention", "block", D, 3, F);
  Randomize(f.Params(), rng);
  const Mat x = RandomMat(D, B, rng);
  AttentionBlock::Masks m;
  m.Resize(3 * K, D, F, B);
  m.Draw(0, rng);
  AttentionBlock::Cache with, without;
  MemoryAttention::Memory memory;
  f.attention.Project(RandomMat(D, K, rng), memory);
  f.Forward(x, memory, &m, with);
  f.Forward(x, memory, nullptr, without);
  EXPECT_EQ(with.out, without.out);
}

}  // namespace
}  // namespace o2v
