#include "base/csv.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>

#include "base/check.h"
#include "base/rng.h"
#include "test_folder.h"

namespace o2v {
namespace {

class Csv : public testing::Test {
 protected:
  CsvTable Read(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return ReadCsv(path_);
  }
  // The message of the ConfigError without the path in front.
  std::string ErrorOf(const std::string& text) {
    try {
      Read(text);
    } catch (const ConfigError& error) {
      const std::string message = error.what();
      return message.starts_with(path_) ? message.substr(path_.size()) : message;
    }
    return "";
  }

  TestFolder folder_;
  std::string path_ = folder_ / "table.csv";
};

TEST_F(Csv, ReadsNamesAndNumbers) {
  const CsvTable table = Read("step,x\n0,-1.5e-3\r\n1,2\n");
  EXPECT_EQ(table.columns, (std::vector<std::string>{"step", "x"}));
  EXPECT_EQ(table.Rows(), 2u);
  EXPECT_EQ(table.At(0, table.Column("x")), -1.5e-3);
  EXPECT_EQ(table.At(1, table.Column("step")), 1);
  EXPECT_THROW(table.Column("y"), ConfigError);
}

TEST_F(Csv, TextIsReadBackExactly) {
  CsvTable table{path_, {"x"}, {0.1, 1.0 / 3, -0.0, 5e-324, 1.7976931348623157e308}};
  EXPECT_EQ(Read(CsvText(table)).values, table.values);
}

TEST_F(Csv, RaggedRowsAreRefused) {
  EXPECT_EQ(ErrorOf("a,b\n1,2\n3\n"), ":3: expected 2 numbers, got 1");
  EXPECT_EQ(ErrorOf("a,b\n1,2,3\n"), ":2: expected 2 numbers, got 3");
  EXPECT_EQ(ErrorOf("a,b\n\n1,2\n"), ":2: expected 2 numbers, got 0");
}

TEST_F(Csv, WhatIsNoFiniteNumberIsRefused) {
  EXPECT_EQ(ErrorOf("a,b\n1,x\n"), ":2: column 'b': expected a finite number, got 'x'");
  EXPECT_EQ(ErrorOf("a,b\n1,\n"), ":2: column 'b': expected a finite number, got ''");
  EXPECT_EQ(ErrorOf("a\n1 2\n"), ":2: column 'a': expected a finite number, got '1 2'");
  EXPECT_EQ(ErrorOf("a\n1\nnan\n"), ":3: column 'a': expected a finite number, got 'nan'");
  EXPECT_EQ(ErrorOf("a\n1e999\n"), ":2: column 'a': expected a finite number, got '1e999'");
}

TEST_F(Csv, BytesThatAreNoTextAreRefusedAndNotPrinted) {
  EXPECT_EQ(ErrorOf(std::string("a\n1\0\n", 5)),
            ":2: column 'a': expected a finite number, got '1?'");
  EXPECT_EQ(ErrorOf(std::string("a\0b\n1\n", 6)), ":1: column 1: expected a name, got 'a?b'");
}

TEST_F(Csv, BadHeadersAreRefused) {
  EXPECT_EQ(ErrorOf(""), ":1: column 1: expected a name, got ''");
  EXPECT_EQ(ErrorOf("a,,b\n1,2,3\n"), ":1: column 2: expected a name, got ''");
  EXPECT_EQ(ErrorOf("a,b,\n1,2,3\n"), ":1: column 3: expected a name, got ''");
  EXPECT_EQ(ErrorOf("a,a\n1,2\n"), ":1: column 'a' appears twice");
}

TEST_F(Csv, AFileWithoutRowsIsRefused) { EXPECT_EQ(ErrorOf("a\n"), ": no rows after the header"); }

TEST_F(Csv, GapsAreReadWhereTheyAreAllowed) {
  std::ofstream(path_) << "a\n";
  EXPECT_EQ(ReadCsv(path_, {.rows = true}).Rows(), 0u);
  EXPECT_THROW(ReadCsv(path_, {.cells = true}), ConfigError);
  std::ofstream(path_) << "a,b,c\n1,,3\n4,5,\n";
  const CsvTable table = ReadCsv(path_, {.cells = true});
  EXPECT_EQ(table.Rows(), 2u);
  EXPECT_TRUE(std::isnan(table.At(0, 1)));
  EXPECT_EQ(table.At(0, 2), 3);
  EXPECT_TRUE(std::isnan(table.At(1, 2)));
  EXPECT_THROW(ReadCsv(path_, {.rows = true}), ConfigError);
}

TEST_F(Csv, MissingFilesAndFoldersAreRefused) {
  EXPECT_THROW(ReadCsv(path_ + ".missing"), ConfigError);
  EXPECT_THROW(ReadCsv(folder_.path()), ConfigError);
}

TEST_F(Csv, DamagedFilesAreReadOrRefusedButNeverCrash) {
  std::string whole = "step,x,y\n";
  for (int i = 0; i < 20; ++i) whole += std::to_string(i) + ",0.25,-1e-3\n";
  Rng rng(1, "damage");  // seed 1
  int refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string damaged = whole;
    if (i % 2 == 0) {
      damaged.resize(rng.UniformInt(whole.size()));
    } else {
      damaged[rng.UniformInt(whole.size())] ^= char(1 << rng.UniformInt(8));
    }
    try {
      Read(damaged);
    } catch (const ConfigError&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 200);
}

}  // namespace
}  // namespace o2v
