#include "report/tensorboard.h"

#include <gtest/gtest.h>

#include "base/check.h"
#include "base/files.h"
#include "test_folder.h"

namespace o2v {
namespace {

using std::string_literals::operator""s;

TEST(Tensorboard, ChecksumsAreThoseOfRfc3720) {
  EXPECT_EQ(Crc32c(""), 0u);
  EXPECT_EQ(Crc32c("123456789"), 0xe3069283u);  // the usual check value of CRC-32C
  std::string rising, falling;
  for (int i = 0; i < 32; ++i) {
    rising += static_cast<char>(i);
    falling += static_cast<char>(31 - i);
  }
  // RFC 3720, B.4; its bytes are in the order of transmission, the lowest first.
  EXPECT_EQ(Crc32c(std::string(32, '\0')), 0x8a9136aau);
  EXPECT_EQ(Crc32c(std::string(32, '\xff')), 0x62a8ab43u);
  EXPECT_EQ(Crc32c(rising), 0x46dd794eu);
  EXPECT_EQ(Crc32c(falling), 0x113fdb5cu);
}

TEST(Tensorboard, RecordsCarryLengthAndMaskedChecksums) {
  // CRC 0xe3069283 rotated right by 15 bits is 0x2507c60d; + 0xa282ead8 = 0xc78ab0e5.
  const std::string record = TfRecord("123456789");
  ASSERT_EQ(record.size(), 8u + 4 + 9 + 4);
  EXPECT_EQ(record.substr(0, 8), "\x09\0\0\0\0\0\0\0"s);
  EXPECT_EQ(record.substr(12, 9), "123456789");
  EXPECT_EQ(record.substr(21), "\xe5\xb0\x8a\xc7"s);
}

TEST(Tensorboard, EventsAreProtocolBuffers) {
  EXPECT_EQ(VersionEvent(), "\x09\0\0\0\0\0\0\0\0\x1a\x0d"s + "brain.Event:2");
  // 1.0 is 0x3ff0000000000000; 300 = 0b10'0101100; -2 as float is 0xc0000000.
  EXPECT_EQ(ScalarEvent(1, 300, "a/b", -2),
            "\x09\0\0\0\0\0\0\xf0\x3f"s  // 1: wall time
            "\x10\xac\x02"s              // 2: step
            "\x2a\x0c"s
            "\x0a\x0a"s  // 5: summary of 12 bytes, its value of 10
            "\x0a\x03"
            "a/b"s               // 1: tag
            "\x15\0\0\0\xc0"s);  // 2: simple_value
}

TEST(Tensorboard, StepsTakeASecondByteFrom128On) {
  const auto step = [](std::int64_t x) {  // up to the summary
    const std::string event = ScalarEvent(0, x, "a", 0);
    return event.substr(9, event.size() - 9 - 12);
  };
  EXPECT_EQ(step(0), "\x10\x00"s);
  EXPECT_EQ(step(127), "\x10\x7f"s);
  EXPECT_EQ(step(128), "\x10\x80\x01"s);
  EXPECT_EQ(step(16384), "\x10\x80\x80\x01"s);
}

TEST(Tensorboard, EveryNumberOfARunIsAnEvent) {
  const TestFolder run;
  WriteFileAtomically(run / "episodes.csv", "step,return\n5,1.5\n9,-2\n");
  WriteFileAtomically(run / "updates.csv", "step,usage_0,duration_0_steps\n8,0.25,\n");
  WriteFileAtomically(run / "timing.csv", "step,wall_s\n8,3.5\n16,7\n");
  std::string expected = TfRecord(VersionEvent());
  expected += TfRecord(ScalarEvent(3.5, 5, "episodes/return", 1.5f));
  expected += TfRecord(ScalarEvent(7, 9, "episodes/return", -2));
  expected += TfRecord(ScalarEvent(3.5, 8, "updates/usage_0", 0.25f));  // the empty cell is none
  expected += TfRecord(ScalarEvent(3.5, 8, "timing/wall_s", 3.5f));
  expected += TfRecord(ScalarEvent(7, 16, "timing/wall_s", 7));
  EXPECT_TRUE(EventFile(run.path()) == expected);
}

TEST(Tensorboard, AFolderWithoutARunIsRefused) {
  const TestFolder empty;
  EXPECT_THROW(EventFile(empty.path()), ConfigError);
  WriteFileAtomically(empty / "episodes.csv", "return\n1\n");  // no step
  EXPECT_THROW(EventFile(empty.path()), ConfigError);
}

}  // namespace
}  // namespace o2v
