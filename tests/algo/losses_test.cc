#include "algo/losses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/check.h"

namespace o2v {
namespace {

/// One sample of ratio r and advantage A at clip range 1/4: surrogate and its derivative by ln r.
struct Sample {
  LossTerms terms;
  Vec dlogp;
  Sample(double r, double A) {
    const Vec logp = Vec::Constant(1, Real(std::log(r))), adv_hat = Vec::Constant(1, Real(A));
    ClippedSurrogate(logp, Vec::Zero(1), adv_hat, 0.25, terms, dlogp);
  }
};

TEST(ClippedSurrogate, IsMinusRatioTimesAdvantageInside) {
  const Sample sample(1.125, 2);
  EXPECT_NEAR(sample.terms.surrogate, -2.25, 1e-6);
  EXPECT_NEAR(sample.dlogp(0), -2.25, 1e-6);
  EXPECT_EQ(sample.terms.clip_fraction, 0);
}

TEST(ClippedSurrogate, StopsAGoodActionAtTheUpperEdgeOnly) {
  const Sample above(1.5, 2), below(0.5, 2);
  EXPECT_NEAR(above.terms.surrogate, -2.5, 1e-6);  // 1.25 * 2
  EXPECT_EQ(above.dlogp(0), 0);
  EXPECT_NEAR(below.terms.surrogate, -1, 1e-6);
  EXPECT_NEAR(below.dlogp(0), -1, 1e-6);
  EXPECT_EQ(above.terms.clip_fraction, 1);
  EXPECT_EQ(below.terms.clip_fraction, 1) << "outside, though its gradient goes on";
}

TEST(ClippedSurrogate, StopsABadActionAtTheLowerEdgeOnly) {
  const Sample above(1.5, -2), below(0.5, -2);
  EXPECT_NEAR(above.terms.surrogate, 3, 1e-6);
  EXPECT_NEAR(above.dlogp(0), 3, 1e-6);
  EXPECT_NEAR(below.terms.surrogate, 1.5, 1e-6);  // 0.75 * 2
  EXPECT_EQ(below.dlogp(0), 0);
  EXPECT_EQ(above.terms.clip_fraction, 1) << "outside, though its gradient goes on";
  EXPECT_EQ(below.terms.clip_fraction, 1);
}

TEST(ClippedSurrogate, AveragesOverTheBatch) {
  Vec logp(2), adv_hat(2), dlogp;
  logp << 0, Real(std::log(1.5));
  adv_hat << 1, 4;
  LossTerms terms;
  ClippedSurrogate(logp, Vec::Zero(2), adv_hat, 0.25, terms, dlogp);
  EXPECT_NEAR(terms.surrogate, -(1 + 1.25 * 4) / 2, 1e-6);
  EXPECT_NEAR(dlogp(0), -0.5, 1e-6);
  EXPECT_EQ(terms.clip_fraction, 0.5);
  EXPECT_NEAR(terms.kl, (1.5 - 1 - std::log(1.5)) / 2, 1e-6);  // Schulman's k3
}

TEST(ClippedSurrogate, RefusesBatchesOfDifferentSizes) {
  LossTerms terms;
  Vec dlogp;
  EXPECT_THROW(ClippedSurrogate(Vec::Zero(2), Vec::Zero(3), Vec::Zero(2), 0.2, terms, dlogp),
               Error);
}

TEST(ValueLoss, IsHalfTheMeanSquare) {
  Vec v(2), ret(2), dv;
  v << 1, 5;
  ret << 0, 8;
  LossTerms terms;
  ValueLoss(v, ret, terms, dv);
  EXPECT_NEAR(terms.value, 0.5 * (1 + 9) / 2, 1e-6);
  EXPECT_EQ(dv, (Vec(2) << 0.5, -1.5).finished());
}

}  // namespace
}  // namespace o2v
