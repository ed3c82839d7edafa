#include "base/csv.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "base/check.h"
#include "base/files.h"

namespace o2v {
namespace {

// The part of `rest` up to `separator`, which is removed from it.
std::string_view Cut(std::string_view& rest, char separator) {
  const std::size_t end = std::min(rest.find(separator), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

std::string_view CutLine(std::string_view& rest) {
  std::string_view line = Cut(rest, '\n');
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

// The text between quotes: cut short, without the bytes that a terminal would obey.
std::string Quoted(std::string_view text) {
  constexpr std::size_t kShown = 40;
  std::string shown(text.substr(0, kShown));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 32 || c > 126; }, '?');
  return "'" + shown + (text.size() > kShown ? "...'" : "'");
}

std::string ReadText(const std::filesystem::path& path) {
  constexpr std::uintmax_t kLargest = std::uintmax_t{1} << 30;  // ours; traces have a few MB
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (!error && size > kLargest) {
    throw ConfigError(Concat(path.string(), ": ", size, " bytes, more than ", kLargest));
  }
  try {
    return ReadFile(path);
  } catch (const Error& e) {
    throw ConfigError(e.what());
  }
}

void ReadHeader(std::string_view line, CsvTable& table) {
  while (true) {
    const bool last = line.find(',') == std::string_view::npos;
    const std::string name(Cut(line, ','));
    const auto bad = [](unsigned char c) { return c < 33 || c > 126 || c == '"'; };
    if (name.empty() || std::any_of(name.begin(), name.end(), bad)) {
      throw ConfigError(Concat(table.path, ":1: column ", table.columns.size() + 1,
                               ": expected a name, got ", Quoted(name)));
    }
    if (std::count(table.columns.begin(), table.columns.end(), name) != 0) {
      throw ConfigError(Concat(table.path, ":1: column ", Quoted(name), " appears twice"));
    }
    table.columns.push_back(name);
    if (last) return;
  }
}

double ReadNumber(std::string_view text, const CsvTable& table, std::size_t row,
                  std::size_t column) {
  double x = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(x)) {
    throw ConfigError(table.Place(row, column) + "expected a finite number, got " + Quoted(text));
  }
  return x;
}

}  // namespace

std::size_t CsvTable::Column(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) {
    throw ConfigError(
        Concat(path, ":1: no column '", name, "' among the ", columns.size(), " columns"));
  }
  return static_cast<std::size_t>(found - columns.begin());
}

std::string CsvTable::Place(std::size_t row, std::size_t column) const {
  return Concat(path, ":", row + 2, ": column '", columns[column], "': ");
}

CsvTable ReadCsv(const std::filesystem::path& path, CsvGaps gaps) {
  const std::string text = ReadText(path);
  CsvTable table{path.string(), {}, {}};
  std::string_view rest = text;
  ReadHeader(CutLine(rest), table);
  for (std::size_t row = 0; !rest.empty(); ++row) {
    std::string_view line = CutLine(rest);
    const auto fields = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (line.empty() || fields != table.columns.size()) {
      throw ConfigError(Concat(table.path, ":", row + 2, ": expected ", table.columns.size(),
                               " numbers, got ", line.empty() ? 0 : fields));
    }
    for (std::size_t column = 0; column < fields; ++column) {
      const std::string_view cell = Cut(line, ',');
      table.values.push_back(gaps.cells && cell.empty() ? std::nan("")
                                                        : ReadNumber(cell, table, row, column));
    }
  }
  if (table.values.empty() && !gaps.rows) {
    throw ConfigError(table.path + ": no rows after the header");
  }
  return table;
}

std::string CsvText(const CsvTable& table) {
  std::string text;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    text += (i ? "," : "") + table.columns[i];
  }
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    char number[32];
    std::snprintf(number, sizeof number, "%.17g", table.values[i]);
    text += i % table.columns.size() ? ',' : '\n';
    text += number;
  }
  return text + "\n";
}

}  // namespace o2v
