#include "report/align.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

TEST(AlignColumns, PadsToTheWidestCellAndLeavesNoTrailingBlanks) {
  EXPECT_EQ(AlignColumns({{"a", "b", "c"}, {"long", "", "x"}, {"y", "z", ""}}),
            "a     b  c\n"
            "long     x\n"
            "y     z\n");
}

TEST(AlignColumns, OfNothingIsEmpty) { EXPECT_EQ(AlignColumns({}), ""); }

}  // namespace
}  // namespace o2v
