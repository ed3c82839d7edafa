#include "base/flush_subnormals.h"

#include <gtest/gtest.h>

#include <limits>

namespace o2v {
namespace {

/// Smallest normal number; not a constant to the compiler, as the product is to be made at run
/// time.
template <typename T>
volatile T smallest = std::numeric_limits<T>::min();
template <typename T>
volatile T subnormal = std::numeric_limits<T>::denorm_min();

template <typename T>
T Half() {
  return smallest<T> * T(0.5);
}
template <typename T>
T Enlarged() {
  return subnormal<T> / std::numeric_limits<T>::epsilon();
}

#ifdef __SSE__
TEST(FlushSubnormals, ResultsAndOperandsAreZeroWhileItLives) {
  {
    const FlushSubnormals flush;
    EXPECT_EQ(Half<float>(), 0);
    EXPECT_EQ(Half<double>(), 0);
    EXPECT_EQ(Enlarged<float>(), 0);
    EXPECT_EQ(Enlarged<double>(), 0);
    EXPECT_EQ(smallest<float> * 1, smallest<float>);
  }
  EXPECT_GT(Half<float>(), 0);
  EXPECT_GT(Half<double>(), 0);
  EXPECT_EQ(Enlarged<float>(), smallest<float>);
  EXPECT_EQ(Enlarged<double>(), smallest<double>);
}
#endif

TEST(FlushSubnormals, EndsWithTheOutermost) {
  const FlushSubnormals outer;
  const float before = Half<float>();
  { const FlushSubnormals inner; }
  EXPECT_EQ(Half<float>(), before);
}

}  // namespace
}  // namespace o2v
