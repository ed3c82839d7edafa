#pragma once
// Tables of numbers in comma-separated text.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace o2v {

/// A header line and rows of finite numbers. Row r stands in line r + 2 of its file.
struct CsvTable {
  std::string path;                  // for messages
  std::vector<std::string> columns;  // C distinct, non-empty names
  std::vector<double> values;        // row after row

  std::size_t Rows() const { return columns.empty() ? 0 : values.size() / columns.size(); }
  double At(std::size_t row, std::size_t column) const {
    return values[row * columns.size() + column];
  }
  /// Position of a column. Throws ConfigError when there is none of that name.
  std::size_t Column(std::string_view name) const;
  /// "FILE:LINE: column 'NAME': ", the start of a message about one number.
  std::string Place(std::size_t row, std::size_t column) const;
};

/// What a table may do without.
struct CsvGaps {
  bool rows = false;   // there may be none after the header
  bool cells = false;  // one may be empty, and is read as NaN
};

/// Reads a table. Throws ConfigError, naming file, line and column, unless there is a header and
/// every line after it holds one finite number for each column; at most 1 GiB is read.
CsvTable ReadCsv(const std::filesystem::path& path, CsvGaps gaps = {});

/// The table as text; every number is read back as it was (17 digits).
std::string CsvText(const CsvTable& table);

}  // namespace o2v
