// Products of every shape against Eigen's, in whole numbers, which have no rounding.

#include "nn/product.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "base/check.h"

namespace o2v {
namespace {

using Form = void (*)(const ConstMatRef&, const ConstMatRef&, MatRef);

/// Strips of 8, 2, 1 and half a register, tiles of 1 to 8 columns, and what is left of each.
constexpr Index kSizes[] = {1,  2,  3,  4,  5,  6,  7,  8,  9,  12, 15,
                            16, 17, 20, 24, 25, 30, 33, 50, 64, 70, 130};
constexpr Index kDepths[] = {0, 1, 2, 3, 4, 17, 40, 127, 128, 129, 300};

class Products : public testing::Test {
 protected:
  Mat Whole(Index rows, Index cols) {
    std::uniform_int_distribution<int> digit(-4, 4);
    return Mat::NullaryExpr(rows, cols, [&] { return Real(digit(rng_)); });
  }

  /// A and B lie in larger matrices, and so does C, of which nothing else may change.
  void Compare(Form form, bool A_transposed, bool B_transposed, bool add) {
    for (const Index m : kSizes) {
      for (const Index n : kSizes) {
        for (const Index k : kDepths) {
          const Mat A = Whole(1 + (A_transposed ? k : m), 2 + (A_transposed ? m : k));
          const Mat B = Whole(2 + (B_transposed ? n : k), 1 + (B_transposed ? k : n));
          const auto a = A.bottomRightCorner(A.rows() - 1, A.cols() - 2);
          const auto b = B.bottomRightCorner(B.rows() - 2, B.cols() - 1);
          Mat C = Whole(m + 3, n + 2), expected = C;
          auto c = expected.block(1, 1, m, n);
          if (!add) c.setZero();
          c += (A_transposed ? Mat(a.transpose()) : Mat(a)) *
               (B_transposed ? Mat(b.transpose()) : Mat(b));
          if (!add) C.block(1, 1, m, n).setConstant(std::numeric_limits<Real>::quiet_NaN());
          form(a, b, C.block(1, 1, m, n));
          ASSERT_EQ(C, expected) << "(" << m << ", " << k << ") times (" << k << ", " << n << ")";
        }
      }
    }
  }

 private:
  std::mt19937 rng_{1};
};

TEST_F(Products, SetABOverwrites) { Compare(SetAB, false, false, false); }
TEST_F(Products, AddABAdds) { Compare(AddAB, false, false, true); }
TEST_F(Products, SetABtOverwrites) { Compare(SetABt, false, true, false); }
TEST_F(Products, AddABtAdds) { Compare(AddABt, false, true, true); }
TEST_F(Products, SetAtBOverwrites) { Compare(SetAtB, true, false, false); }
TEST_F(Products, AddAtBAdds) { Compare(AddAtB, true, false, true); }

TEST_F(Products, AnEntryDependsOnItsRowAndColumnAlone) {
  constexpr Index kLargest = 130;
  for (const Index k : kDepths) {
    const Mat A = Mat::Random(kLargest, k), B = Mat::Random(k, kLargest);
    const Mat A_t = A.transpose(), B_t = B.transpose();
    Mat whole(kLargest, kLargest);
    SetAB(A, B, whole);
    for (const Index m : kSizes) {
      for (const Index n : kSizes) {
        const auto expected = whole.bottomRightCorner(m, n);
        Mat C(m, n);
        SetAB(A.bottomRows(m), B.rightCols(n), C);
        ASSERT_EQ(C, expected) << "(" << m << ", " << k << ") times (" << k << ", " << n << ")";
        SetABt(A.bottomRows(m), B_t.bottomRows(n), C);
        ASSERT_EQ(C, expected) << "(" << m << ", " << k << ") times (" << k << ", " << n << ")";
        SetAtB(A_t.rightCols(m), B.rightCols(n), C);
        ASSERT_EQ(C, expected) << "(" << m << ", " << k << ") times (" << k << ", " << n << ")";
      }
    }
  }
}

TEST_F(Products, RefusesShapesThatDoNotFit) {
  Mat C(2, 3);
  EXPECT_THROW(SetAB(Mat::Zero(2, 4), Mat::Zero(5, 3), C), Error);
  EXPECT_THROW(AddABt(Mat::Zero(2, 4), Mat::Zero(4, 3), C), Error);
  EXPECT_THROW(SetAtB(Mat::Zero(4, 3), Mat::Zero(4, 3), C), Error);
}

}  // namespace
}  // namespace o2v
