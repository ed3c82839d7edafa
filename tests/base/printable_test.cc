#include "base/printable.h"

#include <gtest/gtest.h>

namespace o2v {
namespace {

TEST(Printable, TextLosesWhatATerminalObeysAndNothingElse) {
  EXPECT_EQ(Printable("a\x1b[31mb\n\r\t\x7f"
                      "c"),
            "a?[31mb????c");
  EXPECT_EQ(Printable("a\xc2\x9b"
                      "31mb"),
            "a?31mb")
      << "U+009B is ESC [";
  EXPECT_EQ(Printable("\xc3\xa9 \xc2\xa0 \xc2"), "\xc3\xa9 \xc2\xa0 \xc2");
}

}  // namespace
}  // namespace o2v
