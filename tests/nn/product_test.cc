// Products of every shape against Eigen's, in whole numbers, which have no rounding.

#include "nn/product.h"

#include <gtest/gtest.h>
#include <stdio.h>

#include <cstring>
#include <limits>
#include <random>
#include <string>

#include "base/check.h"
#include "nn/isa.h"
#include "nn/product_kernel.h"

namespace o2v {
namespace {

using Form = void (*)(const ConstMatRef&, const ConstMatRef&, MatRef);

/// None; strips of 8, 2, 1 and half a register, tiles of 1 to 8 columns, and what is left of each.
constexpr Index kSizes[] = {0,  1,  2,  3,  4,  5,  6,  7,  8,  9,  12, 15,
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

/// What a product of numbers below the smallest normal one, above the largest or of none may meet.
constexpr Real kOdd[] = {std::numeric_limits<Real>::quiet_NaN(),
                         std::numeric_limits<Real>::infinity(),
                         -std::numeric_limits<Real>::infinity(),
                         std::numeric_limits<Real>::denorm_min(),
                         std::numeric_limits<Real>::min() / 3,
                         std::numeric_limits<Real>::max(),
                         Real(-0.0)};

TEST_F(Products, WideRegistersGiveTheSameBits) {
  if (!HasV4()) GTEST_SKIP() << "this processor has no AVX-512";
  // Those of BM_Product, of Humanoid, and some of no round size.
  constexpr Index kShapes[][3] = {{64, 17, 64},  {64, 64, 1},   {64, 64, 4}, {64, 64, 64},
                                  {50, 40, 128}, {4, 40, 128},  {40, 40, 4}, {6, 64, 64},
                                  {64, 376, 64}, {33, 130, 29}, {1, 64, 64}, {300, 9, 1}};
  for (const auto& [m, k, n] : kShapes) {
    for (int form = 0; form < 16; ++form) {
      const bool A_t = form & 1, B_t = form & 2, add = form & 4, odd = form & 8;
      Mat A = A_t ? Mat::Random(k, m) : Mat::Random(m, k);
      Mat B = B_t ? Mat::Random(n, k) : Mat::Random(k, n);
      for (Index i = 0; odd && i < 7; ++i) {
        A(i * 5 % A.rows(), i * 3 % A.cols()) = kOdd[i];
        B(i * 7 % B.rows(), i * 2 % B.cols()) = kOdd[6 - i];
      }
      const Factor a{A.data(), A_t ? k : 1, A_t ? 1 : m};
      const Factor b{B.data(), B_t ? n : 1, B_t ? 1 : k};
      Mat narrow = Mat::Random(m, n), wide = narrow;
      v3::Multiply(a, b, m, k, n, {narrow.data(), 1, m, add});
      v4::Multiply(a, b, m, k, n, {wide.data(), 1, m, add});
      ASSERT_EQ(std::memcmp(narrow.data(), wide.data(), std::size_t(m * n) * sizeof(Real)), 0)
          << "(" << m << ", " << k << ") times (" << k << ", " << n << "), form " << form;
      ASSERT_TRUE(odd || narrow.allFinite());
    }
  }
}

TEST(Isa, IsTheOneAskedFor) {
  EXPECT_EQ(ReadIsa(nullptr, true), std::nullopt);
  EXPECT_EQ(ReadIsa("v3", true), Isa::kV3);
  EXPECT_EQ(ReadIsa("v3", false), Isa::kV3);
  EXPECT_EQ(ReadIsa("v4", true), Isa::kV4);
  EXPECT_THROW(ReadIsa("v4", false), ConfigError);
  for (const char* value : {"", "v5", "V3", "v3 ", "avx2"}) {
    EXPECT_THROW(ReadIsa(value, true), ConfigError) << value;
  }
}

TEST(Isa, NoOtherFileRunsWhatIsCompiledForAvx512) {
  // What the object file lends the linker: one function of ours, and Eigen's under other names.
  FILE* const nm = ::popen("nm -AC --defined-only --extern-only " O2V_NN_LIBRARY, "r");
  ASSERT_NE(nm, nullptr);
  int own = 0;
  for (char line[4096]; ::fgets(line, sizeof line, nm);) {
    const std::string symbol = line;
    if (symbol.find(":product_v4.cc.o:") == std::string::npos) continue;
    const bool multiply = symbol.find(" T o2v::v4::Multiply(") != std::string::npos;
    own += multiply;
    EXPECT_TRUE(multiply || symbol.find("EigenV4::") != std::string::npos) << symbol;
  }
  EXPECT_EQ(::pclose(nm), 0);
  EXPECT_EQ(own, 1);
}

TEST_F(Products, RefusesShapesThatDoNotFit) {
  Mat C(2, 3);
  EXPECT_THROW(SetAB(Mat::Zero(2, 4), Mat::Zero(5, 3), C), Error);
  EXPECT_THROW(AddABt(Mat::Zero(2, 4), Mat::Zero(4, 3), C), Error);
  EXPECT_THROW(SetAtB(Mat::Zero(4, 3), Mat::Zero(4, 3), C), Error);
}

}  // namespace
}  // namespace o2v
